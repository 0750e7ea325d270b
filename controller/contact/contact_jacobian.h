#pragma once

// Grasp constraints (section 4.2): rows of the whole-body Jacobian, and their rates along rolling
// contacts. Outputs are the caller's, sized beforehand; nothing allocates.

#include <span>

#include "controller/common/types.h"
#include "controller/contact/grasp_map.h"

namespace dexcheck {

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
