#include "harness/recordings/torque_errors.h"

#include <cmath>

#include "controller/common/linear_algebra.h"

namespace dexcheck {

using Eigen::Index;

VectorXd CalcClusteredVariances(const std::vector<RowCluster>& clusters) {
  const Index p = clusters.front().scores.size();
  MatrixXd H = MatrixXd::Zero(p, p);
  for (const RowCluster& one : clusters) H += one.products;
  const VectorXd scale = H.diagonal().unaryExpr([](double s) { return s > 0.0 ? 1.0 / std::sqrt(s) : 0.0; });
  const SymmetricEigen whole = DecomposeSymmetric(scale.asDiagonal() * H * scale.asDiagonal());
  constexpr double kIndependent = 1e-10, kOthers = 0.02;
  // W^T H W = 1
  MatrixXd W = scale.asDiagonal() * whole.vectors;
  for (Index k = 0; k < p; ++k)
    W.col(k) *= whole.values[k] > kIndependent ? 1.0 / std::sqrt(whole.values[k]) : 0.0;
  VectorXd variances = VectorXd::Zero(p);
  for (const RowCluster& one : clusters) {
    // (1 - C H^-1 C^T)^-1/2 r in place of r: a fit takes away most of what few rows are off.
    const SymmetricEigen part = DecomposeSymmetric(W.transpose() * one.products * W);
    VectorXd score = part.vectors.transpose() * (W.transpose() * one.scores);
    for (Index k = 0; k < p; ++k)
      score[k] *= 1.0 - part.values[k] > kOthers ? 1.0 / std::sqrt(1.0 - part.values[k]) : 0.0;
    variances += (W * (part.vectors * score)).cwiseAbs2();
  }
  return variances;
}

}  // namespace dexcheck
