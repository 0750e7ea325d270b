#pragma once

// Shapes of dry friction besides the sign of the velocity.

#include <map>

#include "controller/common/types.h"

namespace dexcheck {

/// Sign that turns some way after the joint did (presliding); tanh of the velocity over v; sign times
/// exp(-(velocity / v)^2) (Stribeck).
inline constexpr int kSlipShape = 0, kSmoothShapes = 4, kStribeckShapes = 4,
                     kFrictionShapes = 1 + kSmoothShapes + kStribeckShapes;
/// Ratio of the first two velocities of a kind of shape at a joint where its velocity is roughly known.
inline constexpr double kFineRatio = 1.1;
using FrictionRow = Eigen::Matrix<double, 1, kFrictionShapes>;

/// Returns v of each shape, rad/s or m/s: n x kFrictionShapes. @param speeds usual velocities (n).
/// @param stribeck, smooth v of joints where it is roughly known, rad/s or m/s.
MatrixXd ListShapeVelocities(const VectorXd& speeds, const std::map<int, double>& stribeck = {},
                             const std::map<int, double>& smooth = {});

/// At a velocity; kSlipShape as if the joint had moved the same way for long.
FrictionRow CalcFrictionShapes(double velocity, const FrictionRow& shape_velocities);

/// How far presliding has gone in a step: the sign that it turns to, and what it was before. @param moved rad
/// or m.
double CalcSlip(double sign, double before, double moved);

}  // namespace dexcheck
