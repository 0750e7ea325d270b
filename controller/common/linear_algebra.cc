#include "controller/common/linear_algebra.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {

SymmetricEigen DecomposeSymmetric(const Eigen::Ref<const MatrixXd>& S) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(S);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

VectorXd CalcSymmetricEigenvalues(const Eigen::Ref<const MatrixXd>& S) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(S, Eigen::EigenvaluesOnly).eigenvalues();
}

void DecomposeSymmetric(const Matrix6d& S, Vector6d* values, Matrix6d* vectors) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(S);
  *values = solver.eigenvalues();
  *vectors = solver.eigenvectors();
}

void DecomposeGeneralized(const Matrix6d& K, const Matrix6d& Lambda, Vector6d* values, Matrix6d* vectors) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> solver(K, Lambda);
  *values = solver.eigenvalues();
  *vectors = solver.eigenvectors();
}

void FactorIndependent(const Eigen::Ref<const MatrixXd>& A, const char* problem, Eigen::LLT<MatrixXd>* llt) {
  constexpr double kMinPivotRatio = 1e-8;
  double smallest = 0.0;
  llt->compute(A);
  if (llt->info() == Eigen::Success) {
    const auto pivots = llt->matrixLLT().diagonal().array();
    smallest = std::min(1.0, (pivots.square() / A.diagonal().array()).minCoeff());
  }
  if (smallest > kMinPivotRatio) return;
  throw SingularityError(problem + (", smallest independent part " + FormatNumber(smallest)), smallest);
}

LeastSquares::LeastSquares(double independent) {
  if (independent > 0.0) decomposition_.setThreshold(independent);
}

LeastSquares& LeastSquares::Compute(const Eigen::Ref<const MatrixXd>& A) {
  decomposition_.compute(A);
  return *this;
}

VectorXd LeastSquares::Solve(const Eigen::Ref<const VectorXd>& b) const { return decomposition_.solve(b); }

VectorXd LeastSquares::SolveTransposed(const Eigen::Ref<const VectorXd>& b) const {
  return decomposition_.transpose().solve(b);
}

VectorXd SolveLeastSquares(const Eigen::Ref<const MatrixXd>& A, const Eigen::Ref<const VectorXd>& b,
                           double independent) {
  return LeastSquares(independent).Compute(A).Solve(b);
}

MatrixXd CalcPseudoinverse(const Eigen::Ref<const MatrixXd>& A) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(A).pseudoInverse();
}

}  // namespace dexcheck
