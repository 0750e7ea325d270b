#include "controller/dynamics/tree_factor.h"

#include <cmath>

#include "controller/common/errors.h"

namespace dexcheck {

TreeFactor::TreeFactor(const RobotModel& model)
    : L_(RowMatrixXd::Zero(model.num_velocities(), model.num_velocities())) {
  const int base = model.num_base_velocities();
  for (int i = 0; i < base; ++i) parent_.push_back(i - 1);
  for (const Joint& joint : model.joints()) {
    parent_.push_back(joint.parent >= 0 ? base + joint.parent : base - 1);
  }
}

void TreeFactor::Compute(const Eigen::Ref<const MatrixXd>& M) {
  const int n = static_cast<int>(parent_.size());
  Require(M.rows() == n && M.cols() == n, "rows of M", "must be those of xi", static_cast<double>(M.rows()));
  for (int i = 0; i < n; ++i) {
    for (int j = i; j >= 0; j = parent_[static_cast<size_t>(j)]) L_(i, j) = M(i, j);
  }
  // From the tips inward: row k is final, then its part is taken from the rows that it hangs on.
  for (int k = n - 1; k >= 0; --k) {
    const double pivot = L_(k, k);
    Require(pivot > 0.0, "M_bar'", "must be positive definite; pivot", pivot);
    const double root = std::sqrt(pivot);
    const double inverse = 1.0 / root;
    L_(k, k) = root;
    const int above = parent_[static_cast<size_t>(k)];
    for (int i = above; i >= 0; i = parent_[static_cast<size_t>(i)]) L_(k, i) *= inverse;
    for (int i = above; i >= 0; i = parent_[static_cast<size_t>(i)]) {
      const double factor = L_(k, i);
      for (int j = i; j >= 0; j = parent_[static_cast<size_t>(j)]) L_(i, j) -= factor * L_(k, j);
    }
  }
}

void TreeFactor::Multiply(Eigen::Ref<VectorXd> x) const {
  // Rows use entries above themselves only.
  for (int i = static_cast<int>(parent_.size()) - 1; i >= 0; --i) {
    double sum = 0.0;
    for (int j = i; j >= 0; j = parent_[static_cast<size_t>(j)]) sum += L_(i, j) * x[j];
    x[i] = sum;
  }
}

void TreeFactor::Solve(Eigen::Ref<VectorXd> x) const {
  const int n = static_cast<int>(parent_.size());
  for (int i = 0; i < n; ++i) {
    double sum = x[i];
    for (int j = parent_[static_cast<size_t>(i)]; j >= 0; j = parent_[static_cast<size_t>(j)]) {
      sum -= L_(i, j) * x[j];
    }
    x[i] = sum / L_(i, i);
  }
}

void TreeFactor::SolveTransposed(Eigen::Ref<RowMatrixXd> X) const {
  // Plain loops: rows are short, and there are hundreds of them.
  const Eigen::Index width = X.cols();
  for (int i = static_cast<int>(parent_.size()) - 1; i >= 0; --i) {
    double* const x_i = X.data() + i * X.outerStride();
    const double inverse = 1.0 / L_(i, i);
    for (Eigen::Index c = 0; c < width; ++c) x_i[c] *= inverse;
    for (int j = parent_[static_cast<size_t>(i)]; j >= 0; j = parent_[static_cast<size_t>(j)]) {
      double* const x_j = X.data() + j * X.outerStride();
      const double factor = L_(i, j);
      for (Eigen::Index c = 0; c < width; ++c) x_j[c] -= factor * x_i[c];
    }
  }
}

}  // namespace dexcheck
