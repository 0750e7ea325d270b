#pragma once

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

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
