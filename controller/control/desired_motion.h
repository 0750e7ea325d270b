#pragma once

// What the object should do at one instant: in X_o, as the paper has it, and as a pose.

#include "controller/common/types.h"

namespace dexcheck {

/// X_d of (55) and its derivatives: [position in the world, m; ZYZ angles, rad].
struct DesiredMotion {
  Vector6d X_d = Vector6d::Zero();
  Vector6d X_d_dot = Vector6d::Zero();
  Vector6d X_d_ddot = Vector6d::Zero();
};

/// The same without angles: of the desired frame d against the world B.
struct DesiredPose {
  Vector3d p_Bd, p_Bd_dot, p_Bd_ddot;  ///< m, m/s, m/s^2, in the world.
  Matrix3d R_Bd;
  Vector3d omega_d, omega_d_dot;  ///< Body angular velocity and acceleration, axes of d, rad/s, rad/s^2.
};

/// The pose that X_d means; regular at every X_d.
DesiredPose CalcDesiredPose(const DesiredMotion& desired);

}  // namespace dexcheck
