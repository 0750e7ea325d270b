#pragma once

// The last bracket of (55): the acceleration of the object that makes its error obey (57),
// E_ddot + K_v E_dot + K_p E = 0.

#include "controller/common/types.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/trajectory.h"

namespace dexcheck {

/// K_v (1/s) and K_p (1/s^2) of (55), one entry for each axis: x, y, z, then the three of the orientation
/// error.
struct ObjectGains {
  Vector6d K_v = Vector6d::Zero();
  Vector6d K_p = Vector6d::Zero();
};

/// Which orientation error (55) feeds back.
enum class OrientationFeedback {
  kAngles,    ///< E = X_d - X_o in ZYZ angles, as printed.
  kRotation,  ///< e_R = log(R_Bo^T R_Bd), regular at every pose.
};

/// V_Bo_dot (Sigma_o) for the command X_o_ddot = X_d_ddot + K_v (X_d_dot - X_o_dot) + K_p (X_d - X_o), (55):
/// V_Bo_dot = P^-1 X_o_ddot + d/dt(P^-1) X_o_dot.
/// @throws std::logic_error unless the grasp's state was set by X_o.
Vector6d CalcTrackingAcceleration(const ObjectGains& gains, const GraspTerms& grasp,
                                  const DesiredMotion& desired);

/// V_Bo_dot (Sigma_o) for position errors in the world and the orientation error e_R of so3.h; both obey
/// (57).
/// @param V_Bo body velocity at pose X_Bo.
Vector6d CalcTrackingAcceleration(const ObjectGains& gains, const Pose& X_Bo, const Vector6d& V_Bo,
                                  const DesiredPose& desired);

/// One of the two. kRotation also takes a grasp whose state was set by a pose.
Vector6d CalcTrackingAcceleration(const ObjectGains& gains, OrientationFeedback feedback,
                                  const GraspTerms& grasp, const DesiredMotion& desired);

/// How far the object is from its desired motion, as twists in Sigma_o.
struct ObjectErrors {
  /// kAngles: P^-1 (X_d - X_o); kRotation: [R_Bo^T (p_d - p_o); e_R]. m, rad.
  Vector6d e = Vector6d::Zero();
  /// V_d - V_Bo, the desired body velocity less the object's. m/s, rad/s.
  Vector6d V_error = Vector6d::Zero();
  /// Derivative of the desired twist V_d along the object's motion, m/s^2, rad/s^2.
  Vector6d V_d_dot = Vector6d::Zero();
};

/// kAngles: V_d = P^-1 X_d_dot; kRotation: V_d = [R_Bo^T p_d_dot; R_od omega_d]. At the object's own pose
/// either is the desired frame's body velocity. @throws as CalcTrackingAcceleration.
ObjectErrors CalcObjectErrors(OrientationFeedback feedback, const GraspTerms& grasp,
                              const DesiredMotion& desired);

}  // namespace dexcheck
