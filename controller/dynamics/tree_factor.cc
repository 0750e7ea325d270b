#include "controller/dynamics/tree_factor.h"

#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/linear_algebra.h"

namespace dexcheck {
namespace {

/// Short rows, of which there are hundreds: Eigen's loops take them two by two, where a compiler's own
/// prepare for long ones.
using Segment = Eigen::Map<VectorXd>;

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
    // A column, which is contiguous.
    for (size_t k = row.begin; k < row.begin + row.size; ++k) L_[k] = M(path_[k], i);
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
    Segment(entries, static_cast<Eigen::Index>(last)) *= inverse;
    for (size_t above = 0; above < last; ++above) {
      const auto count = static_cast<Eigen::Index>(above) + 1;
      double* const others = L_.data() + rows_[static_cast<size_t>(path_[row.begin + above])].begin;
      Segment(others, count) -= entries[above] * Segment(entries, count);
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
  const Eigen::Index width = X.cols();
  for (auto index = rows.rbegin(); index != rows.rend(); ++index) {
    const Eigen::Index i = *index;
    const Row row = rows_[static_cast<size_t>(i)];
    const size_t last = row.begin + row.size - 1;
    Segment x_i(X.data() + i * X.outerStride(), width);
    x_i *= 1.0 / L_[last];
    for (size_t k = last; k-- > row.begin;)
      Segment(X.data() + path_[k] * X.outerStride(), width) -= L_[k] * x_i;
  }
}

}  // namespace dexcheck
