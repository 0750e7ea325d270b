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

// The object's coordinates X_o = [x, y, z, alpha, beta, gamma] (section 2.5): position of Sigma_o in the
// world frame Sigma_B, m, and ZYZ angles, rad. P(X_o) maps the object's body velocity V_Bo = V^o_Bo = [v;
// omega] (of Sigma_o against Sigma_B, in the object's axes, m/s and rad/s) to X_o_dot; the paper uses P^-1,
// (45) to (47).

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

// Change of frame for twists V = [v; omega] and wrenches F = [f; tau], both 6x1 and linear part first.

/// Adjoint Ad_g of g_ab (6x6): V_a = Ad_g V_b takes a twist from frame b to frame a (used by (22), (30)).
inline Matrix6d CalcAdjoint(const Pose& g_ab) {
  // Ad_g = [R  [p]x R; 0  R]
  const Matrix3d R = g_ab.linear();
  Matrix6d Ad;
  Ad << R, Skew(g_ab.translation()) * R, Matrix3d::Zero(), R;
  return Ad;
}

/// Adjoint of the inverse, Ad_{g^-1} = Ad_g^-1 of g_ab (6x6): takes a twist from frame a to frame b.
inline Matrix6d CalcAdjointInverse(const Pose& g_ab) {
  // Ad_g^-1 = [R^T  -R^T [p]x; 0  R^T]
  const Matrix3d R_transposed = g_ab.linear().transpose();
  Matrix6d Ad;
  Ad << R_transposed, -R_transposed * Skew(g_ab.translation()), Matrix3d::Zero(), R_transposed;
  return Ad;
}

/// Wrench transform Ad_g^-T of g_ab (6x6), (22): F_a = Ad_g^-T F_b takes a wrench from frame b to frame a.
inline Matrix6d CalcWrenchTransform(const Pose& g_ab) { return CalcAdjointInverse(g_ab).transpose(); }

/// Lie bracket matrix ad_V of a twist V = [v; omega] (6x6): with V the body twist of g,
/// d/dt Ad_g = Ad_g ad_V and d/dt Ad_g^-1 = -ad_V Ad_g^-1.
inline Matrix6d CalcTwistCross(const Vector6d& V) {
  // ad_V = [[omega]x  [v]x; 0  [omega]x]
  const Matrix3d omega_cross = Skew(V.tail<3>());
  Matrix6d ad;
  ad << omega_cross, Skew(V.head<3>()), Matrix3d::Zero(), omega_cross;
  return ad;
}

}  // namespace dexcheck
