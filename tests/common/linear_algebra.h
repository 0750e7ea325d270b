#pragma once

// Factorisations that tests take answers from, compiled once.

#include <Eigen/Core>

namespace dexcheck::testing {

using MatrixIn = Eigen::Ref<const Eigen::MatrixXd>;

/// The inverse of a square matrix, by elimination with partial pivoting.
Eigen::MatrixXd CalcInverse(const MatrixIn& A);
/// The Moore-Penrose inverse, of any shape and rank.
Eigen::MatrixXd CalcPseudoinverse(const MatrixIn& A);
/// x in A x = b, of a regular matrix, by elimination with full pivoting.
Eigen::VectorXd SolveDense(const MatrixIn& A, const Eigen::VectorXd& b);
/// By elimination with full pivoting.
Eigen::Index CalcRank(const MatrixIn& A);
/// The largest first.
Eigen::VectorXd CalcSingularValues(const MatrixIn& A);
/// An orthonormal basis of the nullspace of A, which has full row rank: one vector in each column.
Eigen::MatrixXd CalcNullspace(const MatrixIn& A);
/// The eigenvalues of a square matrix.
Eigen::VectorXcd CalcEigenvalues(const MatrixIn& A);

}  // namespace dexcheck::testing
