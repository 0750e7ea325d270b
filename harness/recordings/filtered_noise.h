#pragma once

// Noise of smoothed torques, of which rows that follow each other may have similar errors.

#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// The noise that smoothing leaves of torques behind a drive's filter, or of rounded ones.
///
/// Polynomials are fitted to two halves of a window, every other part of it; they differ by noise alone.
/// Noise that lasts longer than a part is in both. How much of it, the similarity of rows says that follow
/// each other: for filters that remember up to an eighth of the window.
class FilteredNoise {
 public:
  /// @param rows of each window. @param order of the polynomials.
  FilteredNoise(Eigen::Index rows, Eigen::Index joints, int order);

  /// Whether windows have enough rows.
  [[nodiscard]] bool is_possible() const { return static_cast<int>(halves_[1].size()) > order_; }
  /// Begins with a window. @param times of its rows from the centre, s. @param smoothed weights of the rows.
  void SetWindow(const VectorXd& times, const Eigen::RowVectorXd& smoothed);
  /// Adds the torques of a joint in the window. @param quantum to whose multiples they were rounded; 0 for
  /// none, or noise that is as large.
  void Add(Eigen::Index joint, const VectorXd& torque, double quantum);
  /// Standard deviation of a joint's smoothed torque; 0 without windows.
  [[nodiscard]] double Calc(Eigen::Index joint) const;

 private:
  /// Noise of unit variance behind one filter.
  struct Shape {
    VectorXd covariances;  ///< Of what a polynomial leaves of it, by lag in rows from 0.
    double smoothed;       ///< Variance of a smoothed value.
    double halves;         ///< Variance of the halves' difference.
  };

  [[nodiscard]] Eigen::Index CountLags() const;
  /// @param correlations of rows, by lag.
  [[nodiscard]] Shape MakeShape(const VectorXd& correlations) const;
  /// Sets white noise, then filters of first and second order and means over some rows, of several lengths.
  void ListShapes();
  /// Returns the ratio of the standard deviation of smoothed noise to that of the halves' difference, for
  /// white noise with the filtered noise that is most like these covariances.
  [[nodiscard]] double CalcRatio(const VectorXd& covariances) const;

  Eigen::Index rows_;
  int order_;
  std::vector<Eigen::Index> halves_[2];
  std::vector<Shape> shapes_;
  Eigen::RowVectorXd smoothed_, difference_;  // weights of the present window's rows
  MatrixXd basis_;  // orthonormal columns: a polynomial that follows all that a robot does
  std::vector<std::vector<double>> squares_;  // of the halves' differences, by joint
  MatrixXd covariances_;                      // by lag and joint, relative to that of lag 0; sums
  VectorXd rounding_;                         // sums of squares
};

}  // namespace dexcheck
