#include "harness/diagnosis/visible_columns.h"

#include <algorithm>
#include <limits>

#include "controller/common/linear_algebra.h"

namespace dexcheck {

// A column of which less is left beside others, relative, says nothing of its own.
constexpr double kIndependent = 1e-7;

Visible FindVisible(const Candidate& candidate, double noise) {
  const MatrixXd& C = candidate.columns;
  const VectorXd scale = candidate.scale.size() > 0 ? candidate.scale : VectorXd(VectorXd::Ones(C.cols()));
  const bool is_bounded = candidate.scale.size() > 0;
  if (C.cols() == 1) {
    const double size = C.norm();
    if (!(size > 0.0) || (is_bounded && size * scale[0] < noise)) return {};
    return {C, MatrixXd::Identity(1, 1), VectorXd::Ones(1)};
  }
  // Of C diag(scale) = U S V^T those with S above the noise.
  const VectorXd size = C.colwise().norm().transpose();
  const VectorXd unit =
      is_bounded ? scale : VectorXd(size.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; }));
  const MatrixXd scaled = C * unit.asDiagonal();
  const SymmetricEigen eigen = DecomposeSymmetric(scaled.transpose() * scaled);
  const double largest = eigen.values[C.cols() - 1];
  const double least = std::max(is_bounded ? noise * noise : 0.0, kIndependent * kIndependent * largest);
  Eigen::Index visible = 0;
  while (visible < C.cols() && eigen.values[C.cols() - 1 - visible] > least) ++visible;
  Visible result;
  result.basis = unit.asDiagonal() * eigen.vectors.rightCols(visible);
  result.columns = C * result.basis;
  result.unit = unit;
  return result;
}

VectorXd CalcErrors(const Visible& visible, const MatrixXd& covariance) {
  const MatrixXd& B = visible.basis;
  VectorXd error = (B * covariance * B.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
  if (B.rows() == B.cols()) return error;
  // The fraction of each amplitude, squared, that is a combination of those.
  const VectorXd unit = visible.unit.cwiseMax(std::numeric_limits<double>::min());
  const VectorXd known = (unit.cwiseInverse().asDiagonal() * B).rowwise().squaredNorm();
  constexpr double kKnown = 0.99;
  return (known.array() < kKnown).select(std::numeric_limits<double>::infinity(), error);
}

}  // namespace dexcheck
