#pragma once

// Hemispherical fingertips, as the paper has them: the chart of a sphere, and the rim where it ends.

#include "controller/model/robot_model.h"

namespace dexcheck {

/// Length over a fingertip from its point p (3x1, m, fingertip frame) to the rim of its hemisphere:
/// rho (pi/2 - angle between p and the pole), m. Negative past the rim, infinity for a whole sphere.
double CalcRimDistance(const Frame& fingertip, const Vector3d& p);

}  // namespace dexcheck
