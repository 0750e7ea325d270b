#include "controller/control/posture_task.h"

#include "controller/common/errors.h"

namespace dexcheck {

PostureTask::PostureTask(const RobotModel& model)
    : q_posture(VectorXd::Zero(model.num_joints())),
      stiffness(VectorXd::Zero(model.num_joints())),
      damping(VectorXd::Zero(model.num_velocities())),
      xi_reference(VectorXd::Zero(model.num_velocities())),
      acceleration(VectorXd::Zero(model.num_velocities())) {}

void PostureTask::CalcAcceleration(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
                                   Eigen::Ref<VectorXd> sigma_prime) const {
  const Eigen::Index joints = q_posture.size();
  Require(q.size() >= joints, "length of q'", "must include the joints", q.size());
  Require(stiffness.size() == joints, "length of stiffness", "must be that of q_posture", stiffness.size());
  Require(damping.size() == xi.size(), "length of damping", "must be that of xi", damping.size());
  Require(xi_reference.size() == xi.size(), "length of xi_reference", "must be that of xi",
          xi_reference.size());
  Require(acceleration.size() == xi.size(), "length of acceleration", "must be that of xi",
          acceleration.size());
  Require(sigma_prime.size() == xi.size(), "length of sigma'", "must be that of xi", sigma_prime.size());
  sigma_prime = acceleration + damping.cwiseProduct(xi_reference - xi);
  sigma_prime.tail(joints) += stiffness.cwiseProduct(q_posture - q.tail(joints));
}

}  // namespace dexcheck
