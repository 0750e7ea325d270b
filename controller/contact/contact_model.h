#pragma once

// What a contact can transmit (section 4.1 (a)): wrench bases and friction cones of the three contact types.

#include <span>

#include "controller/common/types.h"

namespace dexcheck {

/// Contact types of section 4.1; the paper studies the hard finger.
enum class ContactType {
  kFrictionless,  ///< normal force only, f_c = [f_z]
  kHardFinger,    ///< point contact with friction, f_c = [f_x f_y f_z]
  kSoftFinger,    ///< hard finger that also transmits a moment about the normal, f_c = [f_x f_y f_z tau_z]
};

/// Rows of the contact wrench [f_x f_y f_z tau_x tau_y tau_z] that the contact type transmits; their number
/// is the length m of f_c.
std::span<const int> ListTransmittedRows(ContactType type);

/// Length m of f_c: 1, 3 or 4.
int CountForces(ContactType type);

/// Wrench basis B_c (6 x m) with F_c = B_c f_c in Sigma_cf (20). Print has the hard finger's as 5 wide: it is
/// [I_3; 0].
Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 4> CalcWrenchBasis(ContactType type);

/// Friction of one contact.
struct ContactFriction {
  double mu = 0.0;     ///< tangential force over normal force; hard and soft finger
  double gamma = 0.0;  ///< moment about the normal over normal force, m; soft finger
};

/// Distance of f_c (m x 1, in Sigma_cf: N, N m) from the edge of its friction cone FC (21), in N of normal
/// force: f_z - |f_xy| / mu, for a soft finger f_z - sqrt(|f_xy|^2 / mu^2 + tau_z^2 / gamma^2). Negative
/// outside. Throws std::invalid_argument when a coefficient that the type uses is not positive, or f_c is not
/// m long.
double CalcConeMargin(ContactType type, const ContactFriction& friction,
                      const Eigen::Ref<const VectorXd>& f_c);

}  // namespace dexcheck
