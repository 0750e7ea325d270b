#include "controller/control/joint_law.h"

#include "controller/common/errors.h"

namespace dexcheck {

bool IsJointLaw(ControlLaw law) {
  return law == ControlLaw::kComputedTorque || law == ControlLaw::kPdGravity ||
         law == ControlLaw::kFeedforwardPd;
}

JointLaw::JointLaw(const RobotModel& model, ControlLaw law, const JointGains& gains)
    : law_(law), gains_(gains), actuation_(model) {
  const Eigen::Index n = model.num_velocities();
  Require(model.base().type == BaseType::kFixed, "base", "must be fixed", model.num_base_velocities());
  Require(IsJointLaw(law), "law", "must be one for joints", law);
  const bool computed = law == ControlLaw::kComputedTorque;
  for (const VectorXd* gain : {computed ? &gains.K_p : &gains.K, computed ? &gains.K_v : &gains.D}) {
    Require(gain->size() == n, "number of gains", "must be that of the joints", gain->size());
  }
  for (VectorXd* vector : {&xi_dot_d_, &force_, &tau_}) vector->setZero(n);
}

const VectorXd& JointLaw::CalcTorque(const ModelTerms& robot, const Eigen::Ref<const VectorXd>& q,
                                     const Eigen::Ref<const VectorXd>& xi, const DesiredJoints& desired) {
  xi_dot_d_ = desired.q_ddot;
  if (law_ == ControlLaw::kComputedTorque) {
    // M_bar' (q_d_ddot + K_v e_dot + K_p e) + C_bar' q_dot + F_bar'
    xi_dot_d_ += gains_.K_v.cwiseProduct(desired.q_dot - xi) + gains_.K_p.cwiseProduct(desired.q - q);
    force_ = robot.gravity() + robot.friction();
    force_.noalias() += robot.M() * xi_dot_d_;
    force_.noalias() += robot.C() * xi;
  } else {
    // K e + D e_dot + g
    force_ = robot.gravity();
    force_ += gains_.K.cwiseProduct(desired.q - q) + gains_.D.cwiseProduct(desired.q_dot - xi);
    if (law_ == ControlLaw::kFeedforwardPd) {
      // + M_bar' q_d_ddot + C_bar' q_d_dot + friction
      force_ += robot.friction();
      force_.noalias() += robot.M() * desired.q_ddot;
      force_.noalias() += robot.C() * desired.q_dot;
    }
  }
  actuation_.CalcTorque(force_, tau_);
  return tau_;
}

}  // namespace dexcheck
