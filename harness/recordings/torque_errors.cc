#include "harness/recordings/torque_errors.h"

#include <cmath>
#include <map>
#include <utility>

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

VectorXd CalcClusteredErrors(const TorqueRows& rows, const VectorXd& left,
                             const std::vector<Index>& columns) {
  const auto width = static_cast<Index>(columns.size());
  Eigen::SparseMatrix<double> chosen(rows.columns, width);
  for (Index k = 0; k < width; ++k) chosen.insert(columns[static_cast<size_t>(k)], k) = 1.0;
  const RowCluster none{MatrixXd::Zero(width, width), VectorXd::Zero(width)};
  constexpr Index kStretches = 12;
  std::map<std::pair<size_t, Index>, RowCluster> by_time;
  std::map<size_t, RowCluster> by_joint;
  for (const TorqueRows::Part& part : rows.parts) {
    const MatrixXd C = part.balance->rows(part.place) * MatrixXd(part.map * chosen) + part.pushes * chosen;
    const auto add = [&](Index begin, Index end, RowCluster* to) {
      const auto some = C.middleRows(begin, end - begin);
      to->products.noalias() += some.transpose() * some;
      to->scores.noalias() += some.transpose() * left.segment(part.begin + begin, end - begin);
    };
    add(0, part.size, &by_joint.emplace(part.place, none).first->second);
    // Rows within blocks belong to no stretch.
    add(0, part.within,
        &by_time.emplace(std::pair(static_cast<size_t>(part.begin), Index{-1}), none).first->second);
    const Index blocks = part.size - part.within;
    for (Index k = 0; k < kStretches; ++k)
      add(part.within + k * blocks / kStretches, part.within + (k + 1) * blocks / kStretches,
          &by_time.emplace(std::pair(part.recording, k), none).first->second);
  }
  const auto calc = [](const auto& clusters) {
    std::vector<RowCluster> all;
    all.reserve(clusters.size());
    for (const auto& [key, cluster] : clusters) all.push_back(cluster);
    return CalcClusteredVariances(all);
  };
  return calc(by_time).cwiseMax(calc(by_joint)).cwiseSqrt();
}

}  // namespace dexcheck
