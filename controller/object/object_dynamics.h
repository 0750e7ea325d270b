#pragma once

// Dynamics of the manipulated object (section 3.3): Newton-Euler in the object frame Sigma_o, whose origin is
// the centre of mass. F_o = [force; moment] is the wrench at the origin in the object's axes, N and N m, as
// in (25). Body velocities V_Bo = V^o_Bo = [v; omega] are in the object's axes, m/s and rad/s. The world
// frame is Sigma_B.
//
// Every function throws std::invalid_argument when the body's mass is not positive or its com is not zero.

#include "controller/common/types.h"
#include "controller/model/rigid_body.h"

namespace dexcheck {

/// The form without coordinates, regular at every pose: M_hat V_Bo_dot + C_hat V_Bo + N_o = F_o.
struct ObjectBodyTerms {
  Matrix6d M_hat;  ///< diag(m I_3, I_o), body inertia, constant.
  Matrix6d C_hat;  ///< diag(m [omega]x, -[I_o omega]x), velocity cross terms, skew-symmetric.
  Vector6d N_o;    ///< Minus the gravity wrench, in the object's axes.
};

/// The form in X_o, equation (19): M_o X_o_ddot + C_o X_o_dot + N_o = F_o.
struct ObjectTerms {
  Matrix6d P_inv;        ///< P(X_o)^-1: V_Bo = P_inv X_o_dot.
  Matrix6d P_inv_dot;    ///< d/dt P^-1.
  Vector6d V_Bo;         ///< Body velocity.
  ObjectBodyTerms body;  ///< The regular form at this state.
  Matrix6d M_o;          ///< M_hat P^-1. Not symmetric; P^-T M_o is.
  Matrix6d C_o;          ///< M_hat d/dt P^-1 + C_hat P^-1.
  Vector6d N_o;          ///< As in `body`.
};

/// Terms of the Newton-Euler equations in the object frame.
/// @param gravity in the world frame, m/s^2.
/// @param R_Bo orientation of Sigma_o in the world frame, 3x3.
ObjectBodyTerms CalcObjectBodyTerms(const MassProperties& object, const Vector3d& gravity,
                                    const Matrix3d& R_Bo, const Vector6d& V_Bo);

/// Terms of (19) at X_o, X_o_dot. Departure: the paper leaves their form open; here F_o = G f_c is a wrench
/// in the object frame, so that (19) agrees with (49) and (52) to (55). As Lagrange equations in X_o all
/// terms and F_o carry a factor P^-T; C_hat is chosen so that there d/dt (P^-T M_o) - 2 P^-T C_o is
/// skew-symmetric. Regular at every X_o, also where sin(beta) = 0; there M_o loses rank.
/// @param gravity in the world frame, m/s^2.
ObjectTerms CalcObjectTerms(const MassProperties& object, const Vector3d& gravity, const Vector6d& X_o,
                            const Vector6d& X_o_dot);

/// Kinetic energy V_Bo^T M_hat V_Bo / 2, J.
double CalcObjectKineticEnergy(const MassProperties& object, const Vector6d& V_Bo);

/// Potential energy in gravity, J; zero at the world's origin.
/// @param p_Bo centre of mass in the world frame, m.
double CalcObjectPotentialEnergy(const MassProperties& object, const Vector3d& gravity, const Vector3d& p_Bo);

}  // namespace dexcheck
