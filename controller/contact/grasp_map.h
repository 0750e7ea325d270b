#pragma once

// Grasp map G of any number of hard-finger contacts (section 4.1 (b)) and its rate along rolling contacts.
// A hard finger transmits f_c = [f_x f_y f_z] in Sigma_cf (20): B_c = [I_3; 0], which print has as 5 wide.
// Its friction cone FC (21) is |(f_x, f_y)| <= mu f_z. Outputs are the caller's, sized beforehand; nothing
// allocates.

#include <span>
#include <vector>

#include "controller/common/types.h"
#include "controller/contact/contact_geometry.h"
#include "controller/dynamics/model_terms.h"

namespace dexcheck {

// Contacts of feet with level ground that roll without slipping: spheres, ends of capsules, and, with radius
// 0, corners of boxes.

/// m feet, each the sphere of its frame; a frame without one is a point. With n the upward normal and
/// a = -(r + gap / 2) n from a foot's centre to the middle of gap or overlap, the ground holds
/// v_F + omega x a, the velocity of what touches it:
///
///   J xi = 0,   J xi_dot + J_dot xi = 0,   J_dot xi = a_F + alpha x a + omega x a_dot at xi_dot = 0,
///
/// a_dot = -(n . v_F) n / 2, since n does not turn. Rows are x, y, z in world axes, foot by foot: the third
/// is d/dt of the gap.
class GroundContacts {
 public:
  /// @param feet frames of the model, which outlives this. @param height of the ground, m.
  GroundContacts(const RobotModel& model, std::span<const int> feet, double height = 0.0);

  /// @param robot SetState done, reduced.
  void SetState(const ModelTerms& robot);

  [[nodiscard]] int count() const { return static_cast<int>(feet_.size()); }
  [[nodiscard]] const MatrixXd& J() const { return J_; }                ///< 3m x n.
  [[nodiscard]] const VectorXd& J_dot_xi() const { return J_dot_xi_; }  ///< 3m, m/s^2.
  [[nodiscard]] const VectorXd& gap() const { return gap_; }            ///< m, negative where it overlaps, m.
  [[nodiscard]] const Pose& X_WF(int foot) const { return X_WF_[static_cast<size_t>(foot)]; }
  [[nodiscard]] double radius(int foot) const { return radii_[static_cast<size_t>(foot)]; }  ///< m

 private:
  std::vector<int> feet_;
  std::vector<double> radii_;
  double height_;
  std::vector<Pose> X_WF_;
  MatrixXd J_;
  VectorXd J_dot_xi_, gap_;
  Matrix6Xd J_f_, J_f_dot_;
};

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

/// Rows (3 x n) of the grasp constraint that belong to one contact: B_c^T Ad_{g_cf_f} J_f with the
/// fingertip's body Jacobian J_f (6 x n, twist [v; omega] in the fingertip frame). With J_f = J_sf^f over the
/// finger's joint rates this is a block of J_h (32), (33); with J_f = J_Bf^f reduced to xi, the contact's
/// rows of J_B' (34), (44). `rows` may be a block of a larger matrix. Throws std::invalid_argument when a
/// size does not fit.
void CalcContactJacobian(const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f,
                         Eigen::Ref<MatrixXd> rows);

/// Rate (3 x n) of these rows, J_B_dot' of (46), from J_f_dot (6 x n, componentwise rate in the fingertip
/// frame) and the contact's motion over the fingertip at kappa_dot. Throws as CalcContactJacobian.
void CalcContactJacobianDot(const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f,
                            const Eigen::Ref<const Matrix6Xd>& J_f_dot, Eigen::Ref<MatrixXd> rows_dot);

}  // namespace dexcheck
