#pragma once

// Cholesky factor of a tree's mass matrix that keeps the zeros of the tree: M = L^T L, where row i of L has
// entries only at coordinate i and those it hangs on. Robots with many short branches, such as fingers, have
// few of them.
//
// R. Featherstone, Efficient factorization of the joint-space inertia matrix for branched kinematic trees,
// International Journal of Robotics Research 24(6), 2005.

#include <span>
#include <vector>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// Factor of M_bar' (n x n, reduced coordinates). Nothing allocates after construction.
class TreeFactor {
 public:
  explicit TreeFactor(const RobotModel& model);

  /// M = L^T L; the upper triangle of M (n x n) is read, at the tree's entries.
  /// @throws std::invalid_argument when the size differs or M is not positive definite.
  void Compute(const Eigen::Ref<const MatrixXd>& M);

  /// x (n) becomes L x, with |L x| = sqrt(x^T M x).
  void Multiply(Eigen::Ref<VectorXd> x) const;
  /// x becomes L^-1 x.
  void Solve(Eigen::Ref<VectorXd> x) const;
  /// x becomes L^-T x.
  void SolveTransposed(Eigen::Ref<VectorXd> x) const;
  /// Each column of X (n x k, row-major) becomes L^-T times it.
  void SolveTransposedColumns(Eigen::Ref<RowMatrixXd> X) const;
  /// Multiplies an X by L^-T that is zero except in `rows`; the other rows are neither read nor written.
  /// @param rows ascending, and with each row those that its coordinate hangs on: chains from the base.
  void SolveTransposedColumns(std::span<const int> rows, Eigen::Ref<RowMatrixXd> X) const;
  /// |f|_M^-1 = sqrt(f^T M^-1 f) = |L^-T f|, the size of a force f (n) in the metric of the inertia.
  /// @param work scratch.
  [[nodiscard]] double CalcForceNorm(const Eigen::Ref<const VectorXd>& f, VectorXd* work) const;

 private:
  /// Entries of row i: those of the coordinates from the root to i, which the part of the path up to any of
  /// them has at the same places.
  struct Row {
    size_t begin;  // in L_ and path_
    size_t size;
  };

  /// Sum of L's entries from begin to end, each times its coordinate's of x.
  [[nodiscard]] double Dot(size_t begin, size_t end, const Eigen::Ref<const VectorXd>& x) const;

  std::vector<Row> rows_;
  std::vector<int> all_rows_;
  std::vector<int> path_;  // coordinates from the root, row by row
  std::vector<double> L_;
};

}  // namespace dexcheck
