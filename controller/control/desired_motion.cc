#include "controller/control/desired_motion.h"

#include "controller/object/euler_zyz.h"

namespace dexcheck {

DesiredPose CalcDesiredPose(const DesiredMotion& desired) {
  // V = P^-1 X_dot,  V_dot = P^-1 X_ddot + d/dt(P^-1) X_dot
  const Matrix6d P_inv = CalcPInverse(desired.X_d);
  const Matrix6d P_inv_dot = CalcPInverseDot(desired.X_d, desired.X_d_dot);
  DesiredPose pose;
  pose.p_Bd = desired.X_d.head<3>();
  pose.p_Bd_dot = desired.X_d_dot.head<3>();
  pose.p_Bd_ddot = desired.X_d_ddot.head<3>();
  pose.R_Bd = CalcRotationZyz(desired.X_d.tail<3>());
  pose.omega_d = (P_inv * desired.X_d_dot).tail<3>();
  pose.omega_d_dot = (P_inv * desired.X_d_ddot + P_inv_dot * desired.X_d_dot).tail<3>();
  return pose;
}

}  // namespace dexcheck
