#pragma once

#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// A smooth path of postures: per joint the polynomial through given knots.
class PosturePath {
 public:
  /// Where knot i of `count` lies on the path, from 0 to 1: dense at the ends, so that the polynomial does
  /// not swing between them.
  static double KnotPlace(int i, int count);

  PosturePath() = default;
  /// @param knots postures at KnotPlace(0), .. KnotPlace(n - 1), two or more of one size.
  explicit PosturePath(const std::vector<VectorXd>& knots);

  [[nodiscard]] Eigen::Index size() const { return coefficients_.rows(); }
  /// Posture at s, and its first two derivatives by s. Nothing allocates when the sizes fit.
  void Evaluate(double s, VectorXd* q, VectorXd* q_s, VectorXd* q_ss) const;
  [[nodiscard]] VectorXd Evaluate(double s) const;

 private:
  MatrixXd coefficients_;  // joints x powers of x = 2 s - 1
};

}  // namespace dexcheck
