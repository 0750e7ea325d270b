#pragma once

// Decompositions for what is not done at every step of control: each is compiled once, here, for matrices of
// any size. They allocate.

#include "controller/common/types.h"

namespace dexcheck {

/// Eigenvalues, ascending, and their orthonormal eigenvectors as columns.
struct SymmetricEigen {
  VectorXd values;
  MatrixXd vectors;
};

/// Of a symmetric matrix; its lower triangle is read.
SymmetricEigen DecomposeSymmetric(const Eigen::Ref<const MatrixXd>& S);

/// The eigenvalues alone, ascending.
VectorXd CalcSymmetricEigenvalues(const Eigen::Ref<const MatrixXd>& S);

/// The x of least norm among those that make |A x - b| least, for A of any shape and rank.
/// @param independent a pivot below this fraction of the largest counts as zero; 0 stands for what rounding
/// explains.
VectorXd SolveLeastSquares(const Eigen::Ref<const MatrixXd>& A, const Eigen::Ref<const VectorXd>& b,
                           double independent = 0.0);

/// A^+ of Moore and Penrose, for A of any shape and rank.
MatrixXd CalcPseudoinverse(const Eigen::Ref<const MatrixXd>& A);

}  // namespace dexcheck
