#pragma once

// Pose and velocity of the object by its coordinates X_o, from the engine's quaternion algebra: P^-1 and its
// rate as the checks have them, which share no formula with the model's.

#include "controller/common/types.h"

namespace dexcheck {

/// V_Bo = P_inv X_o_dot, and what V_Bo_dot is at constant X_o_dot.
struct ObjectRates {
  Pose X_Bo = Pose::Identity();
  Vector6d V_Bo = Vector6d::Zero();
  Matrix6d P_inv = Matrix6d::Zero();
  Vector6d bias = Vector6d::Zero();  ///< d/dt (P^-1) X_o_dot, m/s^2 and rad/s^2.
};

/// @param X_o, X_o_dot position and ZYZ angles in the world, and their rates: m, rad, m/s, rad/s.
ObjectRates CalcObjectRates(const Vector6d& X_o, const Vector6d& X_o_dot);

}  // namespace dexcheck
