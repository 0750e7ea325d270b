#pragma once

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// sigma' of (47), which the paper leaves open: a damped posture for the motions that do not move the object,
///   sigma' = acceleration + damping (xi_reference - xi) + stiffness [0; q_posture - q],
/// entry by entry. The base has no posture; it follows because the arms pull toward theirs. Where the null
/// space takes all of sigma' (an arm that holds nothing), critical damping is damping^2 = 4 stiffness; with
/// the three references moving, (18) then follows them by computed torque.
struct PostureTask {
  /// No gains, posture 0, at rest.
  explicit PostureTask(const RobotModel& model);

  VectorXd q_posture;     ///< Joints alone, in their order, rad.
  VectorXd stiffness;     ///< Of the same joints, 1/s^2.
  VectorXd damping;       ///< Of all n entries of xi, 1/s.
  VectorXd xi_reference;  ///< n, m/s, rad/s.
  VectorXd acceleration;  ///< n, of a posture that moves, m/s^2, rad/s^2.

  /// Writes sigma' (n) at q' and xi. @throws std::invalid_argument when a size differs.
  void CalcAcceleration(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
                        Eigen::Ref<VectorXd> sigma_prime) const;
};

}  // namespace dexcheck
