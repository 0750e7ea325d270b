#include "controller/common/linear_algebra.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace dexcheck {

SymmetricEigen DecomposeSymmetric(const Eigen::Ref<const MatrixXd>& S) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(S);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

VectorXd CalcSymmetricEigenvalues(const Eigen::Ref<const MatrixXd>& S) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(S, Eigen::EigenvaluesOnly).eigenvalues();
}

VectorXd SolveLeastSquares(const Eigen::Ref<const MatrixXd>& A, const Eigen::Ref<const VectorXd>& b,
                           double independent) {
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
  if (independent > 0.0) solver.setThreshold(independent);
  return solver.compute(A).solve(b);
}

MatrixXd CalcPseudoinverse(const Eigen::Ref<const MatrixXd>& A) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(A).pseudoInverse();
}

}  // namespace dexcheck
