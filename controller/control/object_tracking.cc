#include "controller/control/object_tracking.h"

#include "controller/object/so3.h"

namespace dexcheck {

Vector6d CalcTrackingAcceleration(const ObjectGains& gains, const GraspTerms& grasp,
                                  const DesiredMotion& desired) {
  // X_o_ddot = X_d_ddot + K_v E_dot + K_p E
  const Vector6d E = desired.X_d - grasp.X_o();
  const Vector6d E_dot = desired.X_d_dot - grasp.X_o_dot();
  const Vector6d X_o_ddot = desired.X_d_ddot + gains.K_v.cwiseProduct(E_dot) + gains.K_p.cwiseProduct(E);
  return grasp.coordinates().P_inv * X_o_ddot + grasp.coordinates().P_inv_dot * grasp.X_o_dot();
}

Vector6d CalcTrackingAcceleration(const ObjectGains& gains, const Pose& X_Bo, const Vector6d& V_Bo,
                                  const DesiredPose& desired) {
  const Matrix3d R_Bo = X_Bo.linear();
  const Vector3d v = V_Bo.head<3>();
  const Vector3d omega = V_Bo.tail<3>();
  // p_ddot = p_d_ddot + K_v E_dot + K_p E with p_dot = R v, hence v_dot = R^T p_ddot - omega x v
  const Vector3d E = desired.p_Bd - X_Bo.translation();
  const Vector3d E_dot = desired.p_Bd_dot - R_Bo * v;
  const Vector3d p_ddot =
      desired.p_Bd_ddot + gains.K_v.head<3>().cwiseProduct(E_dot) + gains.K_p.head<3>().cwiseProduct(E);
  // e_R_ddot = -K_v e_R_dot - K_p e_R
  const OrientationError error = CalcOrientationError(R_Bo, omega, desired.R_Bd, desired.omega_d);
  const Vector3d e_R_ddot =
      -gains.K_v.tail<3>().cwiseProduct(error.e_R_dot) - gains.K_p.tail<3>().cwiseProduct(error.e_R);
  Vector6d V_Bo_dot;
  V_Bo_dot << R_Bo.transpose() * p_ddot - omega.cross(v),
      CalcAngularAcceleration(error, desired.omega_d, desired.omega_d_dot, e_R_ddot);
  return V_Bo_dot;
}

Vector6d CalcTrackingAcceleration(const ObjectGains& gains, OrientationFeedback feedback,
                                  const GraspTerms& grasp, const DesiredMotion& desired) {
  if (feedback == OrientationFeedback::kAngles) return CalcTrackingAcceleration(gains, grasp, desired);
  return CalcTrackingAcceleration(gains, grasp.X_Bo(), grasp.V_Bo(), CalcDesiredPose(desired));
}

ObjectErrors CalcObjectErrors(OrientationFeedback feedback, const GraspTerms& grasp,
                              const DesiredMotion& desired) {
  ObjectErrors errors;
  if (feedback == OrientationFeedback::kAngles) {
    const ObjectTerms& terms = grasp.coordinates();
    errors.e = terms.P_inv * (desired.X_d - grasp.X_o());
    errors.V_error = terms.P_inv * (desired.X_d_dot - grasp.X_o_dot());
    errors.V_d_dot = terms.P_inv * desired.X_d_ddot + terms.P_inv_dot * desired.X_d_dot;
    return errors;
  }
  const DesiredPose pose = CalcDesiredPose(desired);
  const Matrix3d R_oB = grasp.X_Bo().linear().transpose();
  const Vector3d omega = grasp.V_Bo().tail<3>();
  const OrientationError error = CalcOrientationError(grasp.X_Bo().linear(), omega, pose.R_Bd, pose.omega_d);
  const Vector3d v_d = R_oB * pose.p_Bd_dot;
  const Vector3d omega_d = error.R_od * pose.omega_d;
  errors.e << R_oB * (pose.p_Bd - grasp.X_Bo().translation()), error.e_R;
  errors.V_error << v_d - grasp.V_Bo().head<3>(), error.omega_od;
  // d/dt (R_oB x) = R_oB x_dot - omega x (R_oB x), d/dt (R_od x) = R_od (x_dot + omega_d x x) - omega x (R_od
  // x)
  errors.V_d_dot << R_oB * pose.p_Bd_ddot - omega.cross(v_d),
      error.R_od * pose.omega_d_dot - omega.cross(omega_d);
  return errors;
}

}  // namespace dexcheck
