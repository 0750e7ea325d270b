#pragma once

// The object's coordinates X_o = [x, y, z, alpha, beta, gamma] (section 2.5): position of Sigma_o in the
// world frame Sigma_B, m, and ZYZ angles, rad. P(X_o) maps the object's body velocity V_Bo = V^o_Bo = [v;
// omega] (of Sigma_o against Sigma_B, in the object's axes, m/s and rad/s) to X_o_dot; the paper uses P^-1,
// (45) to (47).

#include "controller/common/types.h"

namespace dexcheck {

/// Smallest |sin(beta)| at which ZYZ angles are taken from a pose or a velocity. There alpha and gamma move
/// up to 1000 times as fast as the object turns: at 1 rad/s one radian in a control step of 1 ms, beyond
/// which the branch nearest the last angles is a guess, and three digits of every rate are gone.
inline constexpr double kMinSinBeta = 1e-3;

/// ^B R_o = Rot(z, alpha) Rot(y, beta) Rot(z, gamma), equation (8), 3x3.
/// @param zyz [alpha, beta, gamma], rad.
Matrix3d CalcRotationZyz(const Vector3d& zyz);

/// ZYZ angles of a rotation with beta in (0, pi), alpha and gamma in [-pi, pi], rad.
/// @throws SingularityError when |sin(beta)| < kMinSinBeta; std::invalid_argument when R_Bo is not a
/// rotation.
Vector3d CalcZyzAngles(const Matrix3d& R_Bo);

/// ZYZ angles of a rotation on the branch nearest `previous`, rad: (alpha, beta, gamma) and
/// (alpha + pi, -beta, gamma + pi) are one rotation, and each angle may count full turns.
/// @throws SingularityError when |sin(beta)| < kMinSinBeta; std::invalid_argument when R_Bo is not a rotation
/// or previous is not finite.
Vector3d CalcZyzAngles(const Matrix3d& R_Bo, const Vector3d& previous);

/// ZYZ angles of a rotation also where they are singular: alpha = 0 where it is not determined, rad. For
/// display and for the start of a trajectory; rates there mean nothing.
/// @throws std::invalid_argument when R_Bo is not a rotation.
Vector3d CalcAnyZyzAngles(const Matrix3d& R_Bo);

/// Pose of Sigma_o in Sigma_B at X_o.
Pose CalcObjectPose(const Vector6d& X_o);

/// X_o of a pose, its angles on the branch nearest those of `previous`. Throws as CalcZyzAngles.
Vector6d CalcObjectCoordinates(const Pose& X_Bo, const Vector6d& previous);

/// P^-1, 6x6: V_Bo = P^-1 X_o_dot, equation (45). Defined at every X_o; it loses rank at sin(beta) = 0.
Matrix6d CalcPInverse(const Vector6d& X_o);

/// d/dt P^-1, 6x6, 1/s: what (46) and (47) print as P_dot^-1. Defined at every X_o.
Matrix6d CalcPInverseDot(const Vector6d& X_o, const Vector6d& X_o_dot);

/// P, 6x6: X_o_dot = P V_Bo.
/// @throws SingularityError when |sin(beta)| < kMinSinBeta; std::invalid_argument when beta is not finite.
Matrix6d CalcP(const Vector6d& X_o);

}  // namespace dexcheck
