#pragma once

// Four contacts side by side: one arithmetic operation acts on four contacts. Internal to controller/grasp.

#include <Eigen/Core>
#include <array>
#include <cmath>

namespace dexcheck::grasp_internal {

inline constexpr int kLanes = 4;

/// One number for each of four contacts.
using Lanes = Eigen::Array<double, kLanes, 1>;

/// One vector (x0, x1, x2) for each of four contacts.
using Lanes3 = std::array<Lanes, 3>;

inline Lanes3 ZeroLanes3() { return {Lanes::Zero(), Lanes::Zero(), Lanes::Zero()}; }

inline Lanes CalcDot(const Lanes3& a, const Lanes3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// a^T J b with J = diag(1, -1, -1). det x = x^T J x is positive inside the cone {x0 >= |(x1, x2)|}.
inline Lanes CalcDotJ(const Lanes3& a, const Lanes3& b) { return a[0] * b[0] - a[1] * b[1] - a[2] * b[2]; }

/// Inverse of the longest step along `d` that stays in the cone, from an interior point x with 1/det x given;
/// not positive if no step leaves it.
inline Lanes CalcInverseConeStep(const Lanes3& x, const Lanes& inv_det, const Lanes3& d) {
  // det(x + d / beta) = 0  <=>  beta^2 + 2 p beta + q = 0,  p = x^T J d / det x,  q = det d / det x.
  const Lanes p = CalcDotJ(x, d) * inv_det;
  const Lanes q = CalcDotJ(d, d) * inv_det;
  return (p * p - q).max(0.0).sqrt() - p;
}

}  // namespace dexcheck::grasp_internal
