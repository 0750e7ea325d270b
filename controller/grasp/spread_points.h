#pragma once

// Points that fill a box evenly without being random. Internal to controller/grasp.

#include <cmath>

#include "controller/common/types.h"

namespace dexcheck::grasp_internal {

/// The index-th point (from 1 on) of the additive recurrence x_k = frac(1/2 + index / phi^k), scaled to the
/// box; phi > 1 solves phi^(n+1) = phi + 1 for n coordinates, of which the golden ratio is the case n = 1.
inline VectorXd CalcSpreadPoint(int index, const VectorXd& lower, const VectorXd& upper) {
  const Eigen::Index n = lower.size();
  double phi = 2.0;
  constexpr int kIterations = 40;
  for (int i = 0; i < kIterations; ++i) phi = std::pow(1.0 + phi, 1.0 / static_cast<double>(n + 1));
  VectorXd point(n);
  double step = 1.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    step /= phi;
    const double x = 0.5 + step * index;
    point[k] = lower[k] + (x - std::floor(x)) * (upper[k] - lower[k]);
  }
  return point;
}

}  // namespace dexcheck::grasp_internal
