#pragma once

// The rotation group SO(3): exponential, logarithm, Jacobians, and an orientation error without the
// singularity of the ZYZ angles. A rotation vector phi is axis times angle, rad. "Left" means that the
// increment stands on the left: exp(phi + d) = exp(J_l(phi) d) exp(phi) to first order. The right Jacobian is
// J_l(-phi) = J_l(phi)^T.

#include <string_view>

#include "controller/common/types.h"

namespace dexcheck {

/// Largest entry of |R^T R - I| that still counts as rounding. It admits matrices that were stored in single
/// precision (6e-8 an entry) and stops everything that is not a rotation.
inline constexpr double kRotationTolerance = 1e-6;

/// Throws std::invalid_argument, with `name`, unless R is orthonormal to kRotationTolerance and right-handed.
void RequireRotation(const Matrix3d& R, std::string_view name);

/// exp([phi]x), 3x3: the rotation by |phi| about phi.
Matrix3d ExpSo3(const Vector3d& phi);

/// Rotation vector phi with exp([phi]x) = R and |phi| <= pi, rad, accurate to rounding at every angle. At an
/// angle of pi exactly both signs are right; the one whose largest component is positive is returned.
/// @throws std::invalid_argument when R is not a rotation.
Vector3d LogSo3(const Matrix3d& R);

/// Left Jacobian J_l(phi), 3x3: d/dt exp(phi) = [J_l(phi) phi_dot]x exp(phi).
Matrix3d CalcLeftJacobian(const Vector3d& phi);

/// Inverse of the left Jacobian, 3x3. It is singular at |phi| = 2 pi.
/// @throws std::invalid_argument unless |phi| < 3 pi / 2 (LogSo3 returns at most pi).
Matrix3d CalcLeftJacobianInverse(const Vector3d& phi);

/// d/dt J_l(phi(t)), 3x3, 1/s.
Matrix3d CalcLeftJacobianDot(const Vector3d& phi, const Vector3d& phi_dot);

/// Orientation error of an object frame o against its desired frame d, desired minus actual as in (55), in
/// the object's axes. Regular for every pose; at an error of pi the shortest way back is not unique and e_R
/// jumps.
struct OrientationError {
  Matrix3d R_od;      ///< R_Bo^T R_Bd: the desired frame as the object sees it.
  Vector3d e_R;       ///< log(R_od), rad. Its own image under R_od, so the axes of o and d agree on it.
  Vector3d omega_od;  ///< R_od omega_d - omega_o: angular velocity of d against o, rad/s.
  Vector3d e_R_dot;   ///< d/dt e_R = J_l(e_R)^-1 omega_od, rad/s.
};

/// Orientation error and its rate.
/// @param R_Bo, R_Bd actual and desired orientation in the world frame Sigma_B, 3x3.
/// @param omega_o, omega_d their body angular velocities, each in its own axes, rad/s.
/// @throws std::invalid_argument when R_Bo or R_Bd is not a rotation.
OrientationError CalcOrientationError(const Matrix3d& R_Bo, const Vector3d& omega_o, const Matrix3d& R_Bd,
                                      const Vector3d& omega_d);

/// Body angular acceleration omega_o_dot of the object (its axes, rad/s^2) that gives the error the second
/// derivative e_R_ddot. With e_R_ddot = -K_v e_R_dot - K_p e_R the error obeys (57) exactly.
/// @param omega_d, omega_d_dot desired body angular velocity and acceleration in the axes of d, rad/s,
/// rad/s^2.
Vector3d CalcAngularAcceleration(const OrientationError& error, const Vector3d& omega_d,
                                 const Vector3d& omega_d_dot, const Vector3d& e_R_ddot);

}  // namespace dexcheck
