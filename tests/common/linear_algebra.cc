#include "tests/common/linear_algebra.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace dexcheck::testing {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd CalcInverse(const MatrixIn& A) { return MatrixXd(A).inverse(); }

MatrixXd CalcPseudoinverse(const MatrixIn& A) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(A).pseudoInverse();
}

VectorXd SolveDense(const MatrixIn& A, const VectorXd& b) { return Eigen::FullPivLU<MatrixXd>(A).solve(b); }

Eigen::Index CalcRank(const MatrixIn& A) { return Eigen::FullPivLU<MatrixXd>(A).rank(); }

VectorXd CalcSingularValues(const MatrixIn& A) { return Eigen::JacobiSVD<MatrixXd>(A).singularValues(); }

MatrixXd CalcNullspace(const MatrixIn& A) {
  const MatrixXd Q = Eigen::HouseholderQR<MatrixXd>(A.transpose()).householderQ();
  return Q.rightCols(A.cols() - A.rows());
}

Eigen::VectorXcd CalcEigenvalues(const MatrixIn& A) {
  return Eigen::EigenSolver<MatrixXd>(A, /*computeEigenvectors=*/false).eigenvalues();
}

}  // namespace dexcheck::testing
