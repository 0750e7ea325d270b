#include "controller/control/pseudoinverse.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

Eigen::Index CheckRows(const std::string& name, Eigen::Index rows, Eigen::Index columns) {
  Require(rows > 0, "rows of " + name, "must be positive", rows);
  Require(rows <= columns, "rows of " + name, "must not exceed its columns", rows);
  return rows;
}

}  // namespace

Pseudoinverse::Pseudoinverse(std::string name, Eigen::Index rows, Eigen::Index columns)
    : name_(std::move(name)),
      all_columns_(ListIndices(columns)),
      J_T_(RowMatrixXd::Zero(columns, PadToGramBlock(CheckRows(name_, rows, columns)))),
      W_inv_J_T_(J_T_),
      W_solution_(columns, rows),
      gram_(J_T_.cols(), J_T_.cols()),
      work_(rows),
      gram_llt_(rows),
      W_llt_(columns),
      L_inv_(rows, rows) {
  columns_ = entries_ = all_columns_;
}

void Pseudoinverse::Load(const Eigen::Ref<const MatrixXd>& J, std::span<const int> columns) {
  Require(J.rows() == work_.size(), "rows of J", "must be as constructed", J.rows());
  Require(J.cols() == J_T_.rows(), "columns of J", "must be as constructed", J.cols());
  if (columns.empty()) columns = all_columns_;
  if (!std::equal(columns.begin(), columns.end(), columns_.begin(), columns_.end())) {
    columns_.assign(columns.begin(), columns.end());
    J_T_.setZero();
  }
  for (const int i : columns_) J_T_.row(i).head(J.rows()) = J.col(i).transpose();
}

void Pseudoinverse::Factor(const Eigen::Ref<const MatrixXd>& J, std::span<const int> columns) {
  Load(J, columns);
  SetEntries(columns_);
  for (const int i : columns_) W_inv_J_T_.row(i) = J_T_.row(i);
  CalcGramMatrix(J_T_, columns_, &gram_);
  FactorGram();
}

void Pseudoinverse::FactorDiagonal(const Eigen::Ref<const MatrixXd>& J, const Eigen::Ref<const VectorXd>& w,
                                   std::span<const int> columns) {
  Load(J, columns);
  Require(w.size() == J.cols(), "length of w", "must be the columns of J", w.size());
  for (Eigen::Index i = 0; i < w.size(); ++i) Require(w[i] > 0.0, "entry of w", "must be positive", w[i]);
  SetEntries(columns_);
  for (const int i : columns_) W_inv_J_T_.row(i) = J_T_.row(i) / w[i];
  CalcGramMatrix(J_T_, W_inv_J_T_, columns_, &gram_);
  FactorGram();
}

void Pseudoinverse::FactorWeighted(const Eigen::Ref<const MatrixXd>& J, const Eigen::Ref<const MatrixXd>& W) {
  Load(J, {});
  Require(W.rows() == J.cols(), "rows of W", "must be the columns of J", W.rows());
  Require(W.cols() == J.cols(), "columns of W", "must be the columns of J", W.cols());
  W_llt_.compute(W);
  Require(W_llt_.info() == Eigen::Success, "W", "must be positive definite; trace", W.trace());
  SetEntries(all_columns_);
  // W = L L^T. J W^-1 J^T is formed of half = L^-1 J^T, which loses half of the digits that W^-1 J^T loses.
  W_solution_ = J.transpose();
  W_llt_.matrixL().solveInPlace(W_solution_);
  W_inv_J_T_.leftCols(J.rows()) = W_solution_;
  CalcGramMatrix(W_inv_J_T_, all_columns_, &gram_);
  W_llt_.matrixU().solveInPlace(W_solution_);
  W_inv_J_T_.leftCols(J.rows()) = W_solution_;
  FactorGram();
}

void Pseudoinverse::SetEntries(const std::vector<int>& entries) {
  if (entries == entries_) return;
  entries_ = entries;
  W_inv_J_T_.setZero();
}

void Pseudoinverse::FactorGram() {
  // J W^-1 J^T = L L^T
  condition_number_ = std::numeric_limits<double>::infinity();
  gram_llt_.compute(gram_.topLeftCorner(work_.size(), work_.size()));
  if (gram_llt_.info() == Eigen::Success) {
    // cond_2(J W^-1/2)^2 = cond_2(L L^T) <= tr(L L^T) tr((L L^T)^-1) = |L|^2 |L^-1|^2
    L_inv_.setIdentity();
    gram_llt_.matrixL().solveInPlace(L_inv_);
    condition_number_ = std::sqrt(gram_.diagonal().head(work_.size()).sum()) * L_inv_.norm();
  }
  if (condition_number_ <= kMaxConditionNumber) return;
  throw SingularityError(
      name_ + " has not full row rank, condition number " + FormatNumber(condition_number_),
      condition_number_);
}

void Pseudoinverse::Apply(const Eigen::Ref<const VectorXd>& y, Eigen::Ref<VectorXd> x) {
  work_ = y;
  gram_llt_.solveInPlace(work_);
  x.setZero();
  for (const int i : entries_) x[i] = W_inv_J_T_.row(i).head(work_.size()).dot(work_);
}

void Pseudoinverse::Project(Eigen::Ref<VectorXd> x) {
  // N x = x - J^+ (J x)
  work_.setZero();
  for (const int i : columns_) work_ += x[i] * J_T_.row(i).head(work_.size()).transpose();
  gram_llt_.solveInPlace(work_);
  for (const int i : entries_) x[i] -= W_inv_J_T_.row(i).head(work_.size()).dot(work_);
}

MatrixXd Pseudoinverse::CalcMatrix() const {
  const Eigen::Index k = work_.size();
  const MatrixXd gram = gram_.topLeftCorner(k, k).selfadjointView<Eigen::Lower>();
  return gram.llt().solve(W_inv_J_T_.leftCols(k).transpose()).transpose();
}

MatrixXd Pseudoinverse::CalcProjector() const {
  const Eigen::Index n = J_T_.rows();
  return MatrixXd::Identity(n, n) - CalcMatrix() * J_T_.leftCols(work_.size()).transpose();
}

}  // namespace dexcheck
