#include "controller/control/pseudoinverse.h"

#include <cmath>
#include <limits>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

Eigen::Index CheckRows(const std::string& name, Eigen::Index rows, Eigen::Index columns) {
  Require(rows > 0, "rows of " + name, "must be positive", static_cast<double>(rows));
  Require(rows <= columns, "rows of " + name, "must not exceed its columns", static_cast<double>(rows));
  return rows;
}

}  // namespace

Pseudoinverse::Pseudoinverse(std::string name, Eigen::Index rows, Eigen::Index columns)
    : name_(std::move(name)),
      J_(CheckRows(name_, rows, columns), columns),
      W_inv_J_T_(columns, rows),
      half_(columns, rows),
      gram_(rows, rows),
      L_inv_(rows, rows),
      work_(rows),
      gram_llt_(rows),
      W_llt_(columns) {}

void Pseudoinverse::Load(const Eigen::Ref<const MatrixXd>& J) {
  Require(J.rows() == J_.rows(), "rows of J", "must be as constructed", static_cast<double>(J.rows()));
  Require(J.cols() == J_.cols(), "columns of J", "must be as constructed", static_cast<double>(J.cols()));
  J_ = J;
}

void Pseudoinverse::Factor(const Eigen::Ref<const MatrixXd>& J) {
  Load(J);
  half_ = J_.transpose();
  W_inv_J_T_ = half_;
  FactorGram();
}

void Pseudoinverse::FactorDiagonal(const Eigen::Ref<const MatrixXd>& J, const Eigen::Ref<const VectorXd>& w) {
  Load(J);
  Require(w.size() == J_.cols(), "length of w", "must be the columns of J", static_cast<double>(w.size()));
  for (Eigen::Index i = 0; i < w.size(); ++i) Require(w[i] > 0.0, "entry of w", "must be positive", w[i]);
  half_ = w.cwiseSqrt().cwiseInverse().asDiagonal() * J_.transpose();
  W_inv_J_T_ = w.cwiseInverse().asDiagonal() * J_.transpose();
  FactorGram();
}

void Pseudoinverse::FactorWeighted(const Eigen::Ref<const MatrixXd>& J, const Eigen::Ref<const MatrixXd>& W) {
  Load(J);
  Require(W.rows() == J_.cols(), "rows of W", "must be the columns of J", static_cast<double>(W.rows()));
  Require(W.cols() == J_.cols(), "columns of W", "must be the columns of J", static_cast<double>(W.cols()));
  W_llt_.compute(W);
  Require(W_llt_.info() == Eigen::Success, "W", "must be positive definite; trace", W.trace());
  // W = L L^T, half = L^-1 J^T, W^-1 J^T = L^-T half
  half_ = J_.transpose();
  W_llt_.matrixL().solveInPlace(half_);
  W_inv_J_T_ = half_;
  W_llt_.matrixU().solveInPlace(W_inv_J_T_);
  FactorGram();
}

void Pseudoinverse::FactorGram() {
  // J W^-1 J^T = half^T half = L L^T
  for (Eigen::Index j = 0; j < gram_.cols(); ++j) {
    const Eigen::Index rest = gram_.rows() - j;
    gram_.col(j).tail(rest).noalias() = half_.rightCols(rest).transpose() * half_.col(j);
  }
  gram_llt_.compute(gram_);
  condition_number_ = std::numeric_limits<double>::infinity();
  if (gram_llt_.info() == Eigen::Success) {
    // cond_2(J W^-1/2)^2 = cond_2(L L^T) <= tr(L L^T) tr((L L^T)^-1) = |L|^2 |L^-1|^2
    L_inv_.setIdentity();
    gram_llt_.matrixL().solveInPlace(L_inv_);
    condition_number_ = std::sqrt(gram_.trace()) * L_inv_.norm();
  }
  if (condition_number_ <= kMaxConditionNumber) return;
  throw SingularityError(
      name_ + " has not full row rank, condition number " + FormatNumber(condition_number_),
      condition_number_);
}

void Pseudoinverse::Apply(const Eigen::Ref<const VectorXd>& y, Eigen::Ref<VectorXd> x) {
  work_ = y;
  gram_llt_.solveInPlace(work_);
  x.noalias() = W_inv_J_T_ * work_;
}

void Pseudoinverse::ApplyTransposed(const Eigen::Ref<const VectorXd>& x, Eigen::Ref<VectorXd> y) {
  y.noalias() = W_inv_J_T_.transpose() * x;
  gram_llt_.solveInPlace(y);
}

void Pseudoinverse::Project(Eigen::Ref<VectorXd> x) {
  // N x = x - J^+ (J x)
  work_.noalias() = J_ * x;
  gram_llt_.solveInPlace(work_);
  x.noalias() -= W_inv_J_T_ * work_;
}

MatrixXd Pseudoinverse::CalcMatrix() const { return gram_llt_.solve(W_inv_J_T_.transpose()).transpose(); }

MatrixXd Pseudoinverse::CalcProjector() const {
  return MatrixXd::Identity(J_.cols(), J_.cols()) - CalcMatrix() * J_;
}

}  // namespace dexcheck
