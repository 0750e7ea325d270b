#include "controller/dynamics/tree_factor.h"

#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"

namespace dexcheck {
namespace {

/// y -= a x. Rows are short and there are hundreds: loops that first look for an aligned place, or prepare
/// for long rows, take longer.
inline void SubtractMultiple(double a, const double* x, size_t count, double* y) {
  size_t i = 0;
  for (; i + 1 < count; i += 2)
    Eigen::Map<Eigen::Array2d>(y + i) -= a * Eigen::Map<const Eigen::Array2d>(x + i);
  if (i < count) y[i] -= a * x[i];
}

}  // namespace

TreeFactor::TreeFactor(const RobotModel& model) {
  const auto add = [&](std::span<const int> path) {
    rows_.push_back({path_.size(), path.size()});
    path_.insert(path_.end(), path.begin(), path.end());
  };
  const std::vector<int> base = model.ListMovingEntries(-1);
  for (size_t i = 1; i <= base.size(); ++i) add(std::span(base).first(i));
  for (int joint = 0; joint < model.num_joints(); ++joint) {
    const std::vector<int> entries = model.ListMovingEntries(joint);
    for (auto k = static_cast<size_t>(CountVelocities(model.joint(joint).type)); k-- > 0;)
      add(std::span(entries).first(entries.size() - k));
  }
  L_.assign(path_.size(), 0.0);
  all_rows_ = ListIndices(rows_.size());
}

void TreeFactor::Compute(const Eigen::Ref<const MatrixXd>& M) {
  const auto n = static_cast<Eigen::Index>(rows_.size());
  Require(M.rows() == n && M.cols() == n, "rows of M", "must be those of xi", M.rows());
  for (Eigen::Index i = 0; i < n; ++i) {
    const Row row = rows_[static_cast<size_t>(i)];
    const double* const column = M.col(i).data();
    for (size_t k = row.begin; k < row.begin + row.size; ++k) L_[k] = column[path_[k]];
  }
  // From the tips inward: a row is final, then its part is taken from the rows that it hangs on.
  for (auto i = rows_.rbegin(); i != rows_.rend(); ++i) {
    const Row row = *i;
    double* const entries = L_.data() + row.begin;
    const size_t last = row.size - 1;
    const double pivot = entries[last];
    Require(pivot > 0.0, "M_bar'", "must be positive definite; pivot", pivot);
    const double root = std::sqrt(pivot);
    const double inverse = 1.0 / root;
    entries[last] = root;
    for (size_t k = 0; k < last; ++k) entries[k] *= inverse;
    for (size_t above = 0; above < last; ++above) {
      const Row& other = rows_[static_cast<size_t>(path_[row.begin + above])];
      SubtractMultiple(entries[above], entries, above + 1, L_.data() + other.begin);
    }
  }
}

double TreeFactor::Dot(size_t begin, size_t end, const Eigen::Ref<const VectorXd>& x) const {
  // Two sums, so that neither waits for the other.
  double even = 0.0, odd = 0.0;
  for (; begin + 1 < end; begin += 2) {
    even += L_[begin] * x[path_[begin]];
    odd += L_[begin + 1] * x[path_[begin + 1]];
  }
  if (begin < end) even += L_[begin] * x[path_[begin]];
  return even + odd;
}

void TreeFactor::Multiply(Eigen::Ref<VectorXd> x) const {
  // Rows use entries above themselves only.
  for (auto i = static_cast<Eigen::Index>(rows_.size()) - 1; i >= 0; --i) {
    const Row row = rows_[static_cast<size_t>(i)];
    x[i] = Dot(row.begin, row.begin + row.size, x);
  }
}

void TreeFactor::Solve(Eigen::Ref<VectorXd> x) const {
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(rows_.size()); ++i) {
    const Row row = rows_[static_cast<size_t>(i)];
    const size_t last = row.begin + row.size - 1;
    x[i] = (x[i] - Dot(row.begin, last, x)) / L_[last];
  }
}

void TreeFactor::SolveTransposed(Eigen::Ref<VectorXd> x) const {
  for (auto i = static_cast<Eigen::Index>(rows_.size()) - 1; i >= 0; --i) {
    const Row row = rows_[static_cast<size_t>(i)];
    const size_t last = row.begin + row.size - 1;
    const double x_i = x[i] * (1.0 / L_[last]);
    x[i] = x_i;
    for (size_t k = row.begin; k < last; ++k) x[path_[k]] -= L_[k] * x_i;
  }
}

double TreeFactor::CalcForceNorm(const Eigen::Ref<const VectorXd>& f, VectorXd* work) const {
  *work = f;
  SolveTransposed(*work);
  return work->norm();
}

void TreeFactor::SolveTransposedColumns(Eigen::Ref<RowMatrixXd> X) const {
  SolveTransposedColumns(all_rows_, X);
}

void TreeFactor::SolveTransposedColumns(std::span<const int> rows, Eigen::Ref<RowMatrixXd> X) const {
  const auto width = static_cast<size_t>(X.cols());
  for (auto index = rows.rbegin(); index != rows.rend(); ++index) {
    const Eigen::Index i = *index;
    const Row row = rows_[static_cast<size_t>(i)];
    const size_t last = row.begin + row.size - 1;
    double* const x_i = X.data() + i * X.outerStride();
    const double inverse = 1.0 / L_[last];
    for (size_t k = 0; k < width; ++k) x_i[k] *= inverse;
    for (size_t k = last; k-- > row.begin;)
      SubtractMultiple(L_[k], x_i, width, X.data() + path_[k] * X.outerStride());
  }
}

}  // namespace dexcheck
