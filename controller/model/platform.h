#pragma once

// The differential-drive platform (section 2.1): q_v = [x_c, y_c, phi], where (x_c, y_c) is the midpoint of
// the wheel axle in the world's floor plane, m, and phi the heading, rad. The right wheel stands at y = -b/2
// of Sigma_0, the left one at +b/2; a positive wheel rate rolls the platform forward.

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// Rolling constraint of the platform at one q_v and v.
struct PlatformConstraint {
  Eigen::RowVector3d A_v;               ///< A_v q_v_dot = 0, equations (1), (2).
  Eigen::Matrix<double, 3, 2> S_v;      ///< q_v_dot = S_v v, equation (12).
  Eigen::Matrix<double, 3, 2> S_v_dot;  ///< d/dt S_v, equation (13), 1/s.
  Eigen::Matrix<double, 3, 2> E_v;      ///< Generalised forces on q_v are E_v [tau_r; tau_l], equation (15).
  Matrix2d S_v_T_E_v;                   ///< The same forces on v, equation (17).
};

/// A_v, S_v, S_v_dot and E_v for the base's choice of v.
/// Departure: (x_c, y_c) is the axle's midpoint; for the centre of mass, as printed, (1) would need another
/// term.
/// @param q_v [x_c, y_c, phi], m and rad.
/// @param v [v_c, w_c], m/s and rad/s, or [thetadot_r, thetadot_l], rad/s, as base.velocity says.
/// @throws std::invalid_argument when the base is not a differential drive or r or b is not positive.
PlatformConstraint CalcPlatformConstraint(const Base& base, const Vector3d& q_v, const Vector2d& v);

/// Constant 2x2 map from v to the wheel rates: [thetadot_r; thetadot_l] = W v. For v = [v_c, w_c],
/// thetadot_r = (v_c + w_c b/2) / r and thetadot_l = (v_c - w_c b/2) / r; for wheel rates the identity.
/// @throws as CalcPlatformConstraint.
Matrix2d CalcWheelRateMap(const Base& base);

/// E_bar' of (17), (18) = diag(S_v^T E_v, 1): torques tau' (n; first [tau_r; tau_l] of the wheels) to forces
/// on xi, and back. Constant; for other bases the identity, but that nothing drives a floating one: its six
/// entries of tau' are zero.
class ActuationMap {
 public:
  explicit ActuationMap(const RobotModel& model);

  /// force (n) = E_bar' tau' (n). Both may be the same vector. Throws std::invalid_argument when a size
  /// differs.
  void CalcForce(const Eigen::Ref<const VectorXd>& tau, Eigen::Ref<VectorXd> force) const;
  /// tau' (n) = E_bar'^-1 force (n), under the conditions of CalcForce.
  void CalcTorque(const Eigen::Ref<const VectorXd>& force, Eigen::Ref<VectorXd> tau) const;

 private:
  void Apply(const Matrix2d& wheels, const Eigen::Ref<const VectorXd>& from, Eigen::Ref<VectorXd> to) const;

  Eigen::Index size_;
  bool has_wheels_, floats_;
  Matrix2d S_v_T_E_v_ = Matrix2d::Identity();
  Matrix2d inverse_ = Matrix2d::Identity();
};

}  // namespace dexcheck
