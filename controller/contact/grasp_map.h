#pragma once

// Grasp map G of any number of contacts (section 4.1 (b)) and its rate along rolling contacts. Outputs are
// the caller's, sized beforehand; nothing allocates.

#include <span>

#include "controller/common/types.h"
#include "controller/contact/contact_geometry.h"
#include "controller/contact/contact_model.h"

namespace dexcheck {

/// One contact of a grasp at one instant.
struct Contact {
  ContactType type = ContactType::kHardFinger;
  ContactGeometry geometry;
  Vector5d kappa_dot = Vector5d::Zero();  ///< (40), used by the rates only
};

/// Length of f_c = [f_c1; ...; f_cN] (25): the sum of the contacts' force counts.
int CountForces(std::span<const Contact> contacts);

/// Grasp map G = [G_1 ... G_N], G_i = Ad_{g_o_cf}^-T B_ci (22)-(24): F_o = G f_c is the wrench [f; tau] on
/// the object (25), in the object frame at its origin (centre of mass), of the forces of finger on object.
/// `G` is 6 x CountForces(contacts); throws std::invalid_argument otherwise, or without contacts.
void CalcGraspMap(std::span<const Contact> contacts, Eigen::Ref<Matrix6Xd> G);

/// Rate G_dot (6 x CountForces(contacts)) of the grasp map while the contacts move at their kappa_dot, as
/// (46) needs it. Throws as CalcGraspMap.
void CalcGraspMapDot(std::span<const Contact> contacts, Eigen::Ref<Matrix6Xd> G_dot);

/// Throws std::invalid_argument when G (6 x m) has fewer than six columns, SingularityError with the ratio of
/// its extreme singular values when it does not have rank 6: such a grasp cannot exert every wrench (26), and
/// G^+ in (49) is not a right inverse. Moments are measured against the largest moment arm of G.
void RequireFullGrasp(const Eigen::Ref<const Matrix6Xd>& G);

}  // namespace dexcheck
