#pragma once

// Grasp map G of any number of hard-finger contacts (section 4.1 (b)) and its rate along rolling contacts.
// A hard finger transmits f_c = [f_x f_y f_z] in Sigma_cf (20): B_c = [I_3; 0], which print has as 5 wide.
// Its friction cone FC (21) is |(f_x, f_y)| <= mu f_z. Outputs are the caller's, sized beforehand; nothing
// allocates.

#include <span>

#include "controller/common/types.h"
#include "controller/contact/contact_geometry.h"

namespace dexcheck {

/// One contact of a grasp at one instant.
struct Contact {
  ContactGeometry geometry;
  Vector5d kappa_dot = Vector5d::Zero();  ///< (40), used by the rates only
};

/// Grasp map G = [G_1 ... G_N], G_i = Ad_{g_o_cf}^-T B_ci (22)-(24): F_o = G f_c is the wrench [f; tau] on
/// the object (25), in the object frame at its origin (centre of mass), of the forces of finger on object.
/// `G` is 6 x 3N; throws std::invalid_argument otherwise, or without contacts.
void CalcGraspMap(std::span<const Contact> contacts, Eigen::Ref<Matrix6Xd> G);

/// Rate G_dot (6 x 3N) of the grasp map while the contacts move at their kappa_dot, as
/// (46) needs it. Throws as CalcGraspMap.
void CalcGraspMapDot(std::span<const Contact> contacts, Eigen::Ref<Matrix6Xd> G_dot);

}  // namespace dexcheck
