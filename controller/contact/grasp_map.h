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

// Grasp constraints (section 4.2): rows of the whole-body Jacobian, and their rates along rolling
// contacts. Outputs are the caller's, sized beforehand; nothing allocates.

/// Consecutive columns of a matrix.
struct ColumnRun {
  Eigen::Index begin = 0;
  Eigen::Index count = 0;
};

/// Rows (3 x n) of the grasp constraint that belong to one contact: B_c^T Ad_{g_cf_f} J_f with the
/// fingertip's body Jacobian J_f (6 x n, twist [v; omega] in the fingertip frame). With J_f = J_sf^f over the
/// finger's joint rates this is a block of J_h (32), (33); with J_f = J_Bf^f reduced to xi, the contact's
/// rows of J_B' (34), (44). `rows` may be a block of a larger matrix. Throws std::invalid_argument when a
/// size does not fit.
/// @param columns where J_f can differ from zero: the other columns of `rows` are left alone. All when empty.
void CalcContactJacobian(const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f,
                         Eigen::Ref<MatrixXd> rows, std::span<const ColumnRun> columns = {});

/// Rate (3 x n) of these rows, J_B_dot' of (46), from J_f_dot (6 x n, componentwise rate in the fingertip
/// frame) and the contact's motion over the fingertip at kappa_dot. Throws and uses `columns` as
/// CalcContactJacobian.
void CalcContactJacobianDot(const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f,
                            const Eigen::Ref<const Matrix6Xd>& J_f_dot, Eigen::Ref<MatrixXd> rows_dot,
                            std::span<const ColumnRun> columns = {});

}  // namespace dexcheck
