#pragma once

#include <cmath>

#include "controller/common/types.h"

namespace dexcheck {

/// One row of a table of modified Denavit-Hartenberg parameters (Craig's convention, Figure 3).
struct MdhRow {
  double alpha = 0.0;  ///< Angle from Z_{i-1} to Z_i about X_{i-1}, rad.
  double a = 0.0;      ///< Distance from Z_{i-1} to Z_i along X_{i-1}, m.
  double q = 0.0;      ///< Home angle from X_{i-1} to X_i about Z_i, rad (the table's q column).
  double d = 0.0;      ///< Distance from X_{i-1} to X_i along Z_i, m.
};

/// ^{i-1}T_i = Rot(x, alpha) Trans(x, a) Rot(z, q) Trans(z, d), equation (4).
/// @param theta total angle about Z_i, rad.
/// @param d total displacement along Z_i, m.
inline Pose CalcMdhTransform(double alpha, double a, double theta, double d) {
  const double ca = std::cos(alpha);
  const double sa = std::sin(alpha);
  const double cq = std::cos(theta);
  const double sq = std::sin(theta);
  Pose T;
  // clang-format off
  T.matrix() << cq,      -sq,       0.0,   a,
                sq * ca,  cq * ca, -sa,   -d * sa,
                sq * sa,  cq * sa,  ca,    d * ca,
                0.0,      0.0,      0.0,   1.0;
  // clang-format on
  return T;
}

}  // namespace dexcheck
