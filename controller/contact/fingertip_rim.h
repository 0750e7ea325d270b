#pragma once

// Hemispherical fingertips, as the paper has them: the chart of a sphere, and the rim where it ends.

#include "controller/common/types.h"

namespace dexcheck {

/// Length over a fingertip of this radius (m) from its point p (3x1, m, fingertip frame) to the rim of the
/// hemisphere around `pole` (3x1, any length, same frame): rho (pi/2 - angle between p and the pole), m.
/// Negative past the rim.
double CalcRimDistance(double radius, const Vector3d& pole, const Vector3d& p);

}  // namespace dexcheck
