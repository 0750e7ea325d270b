#include "controller/control/joint_controller.h"

#include "controller/common/errors.h"
#include "controller/object/so3.h"

namespace dexcheck {

bool IsJointLaw(ControlLaw law) {
  return law == ControlLaw::kComputedTorque || law == ControlLaw::kPdGravity ||
         law == ControlLaw::kFeedforwardPd;
}

void AddFrictionCompensation(const JointGains& gains, const VectorXd& q_d_dot, VectorXd* force) {
  if (gains.coulomb.size() > 0)
    *force += gains.coulomb.cwiseProduct((q_d_dot / gains.coulomb_velocity).array().tanh().matrix());
  if (gains.viscous.size() > 0) *force += gains.viscous.cwiseProduct(q_d_dot);
}

JointLaw::JointLaw(const RobotModel& model, ControlLaw law, const JointGains& gains)
    : law_(law), gains_(gains), actuation_(model) {
  const Eigen::Index n = model.num_velocities();
  const bool stands = model.base().type == BaseType::kFloating && gains.stance;
  Require(model.base().type == BaseType::kFixed || stands, "base", "must be fixed, or stand",
          model.num_base_velocities());
  if (stands) stance_ = std::make_unique<StanceForces>(model, *gains.stance);
  Require(IsJointLaw(law), "law", "must be one for joints", law);
  const bool computed = law == ControlLaw::kComputedTorque;
  for (const VectorXd* gain : {computed ? &gains.K_p : &gains.K, computed ? &gains.K_v : &gains.D}) {
    Require(gain->size() == n, "number of gains", "must be that of the joints", gain->size());
  }
  for (const VectorXd* friction : {&gains.coulomb, &gains.viscous}) {
    Require(friction->size() == 0 || friction->size() == n, "number of frictions",
            "must be that of the joints", friction->size());
  }
  Require(gains.coulomb_velocity > 0.0, "coulomb_velocity", "must be positive", gains.coulomb_velocity);
  for (VectorXd* vector : {&xi_dot_d_, &force_, &tau_, &error_}) vector->setZero(n);
}

const VectorXd& JointLaw::CalcTorque(const ModelTerms& robot, const Eigen::Ref<const VectorXd>& q,
                                     const Eigen::Ref<const VectorXd>& xi, const DesiredJoints& desired) {
  xi_dot_d_ = desired.q_ddot;
  CalcPositionError(stance_ != nullptr, desired.q, q, error_);
  if (law_ == ControlLaw::kComputedTorque) {
    // M_bar' (q_d_ddot + K_v e_dot + K_p e) + C_bar' q_dot + F_bar'
    xi_dot_d_ += gains_.K_v.cwiseProduct(desired.q_dot - xi) + gains_.K_p.cwiseProduct(error_);
    force_ = robot.gravity() + robot.friction();
    force_.noalias() += robot.M() * xi_dot_d_;
    force_.noalias() += robot.C() * xi;
  } else {
    // K e + D e_dot + g
    force_ = robot.gravity();
    force_ += gains_.K.cwiseProduct(error_) + gains_.D.cwiseProduct(desired.q_dot - xi);
    if (law_ == ControlLaw::kFeedforwardPd) {
      // + M_bar' q_d_ddot + C_bar' q_d_dot + friction
      force_ += robot.friction();
      force_.noalias() += robot.M() * desired.q_ddot;
      force_.noalias() += robot.C() * desired.q_dot;
    }
  }
  AddFrictionCompensation(gains_, desired.q_dot, &force_);
  if (stance_) {
    stance_->TakeOff(robot, force_);
    ground_forces_ = stance_->f();
  }
  actuation_.CalcTorque(force_, tau_);
  return tau_;
}

JointController::JointController(const RobotModel& model, const MassProperties& object,
                                 const Surface& surface, ControlLaw law, const JointGains& gains,
                                 const JointMotion& motion, const Sampling& sampling)
    : model_(model, {}, object, surface, {.orientation = OrientationFeedback::kRotation}),
      law_(model, law, gains),
      demand_(motion, sampling.time_step),
      sampling_(sampling) {
  Require(sampling.hold > 0, "sampling.hold", "must be positive", sampling.hold);
}

void JointController::Follow(const Trajectory& /*motion*/) { steps_until_due_ = 0; }

void JointController::Begin(double /*t*/, const Reading& /*reading*/) {
  demand_.Begin();
  steps_until_due_ = 0;
}

void JointDemand::EvaluateDesired(const JointMotion& motion, double t, double time_step,
                                  DesiredJoints* desired, DesiredJoints* half_step) {
  motion.Evaluate(t, desired);
  // Semi-implicit Euler steps like a leapfrog: velocities belong to the middle of the step before.
  motion.Evaluate(t - 0.5 * time_step, half_step);
  desired->q_dot = half_step->q_dot;
}

void JointDemand::Fill(const Reading& reading, double t, Command* command) {
  constexpr double kBefore = -1.0;  // s, when the motion is at its start
  command->tracks = false;
  command->handling.holding = false;
  command->desired.X_d << reading.state.X_Bo.translation(), CalcAnyZyzAngles(reading.state.X_Bo.linear());
  EvaluateDesired(*motion_, has_begun_ ? t : kBefore, time_step_, &command->joints, &half_step_);
}

void JointController::Step(const Reading& reading, double t, Command* command) {
  demand_.Fill(reading, t, command);
  model_.SetState(reading.state);
  command->computes_joints = steps_until_due_ == 0;
  if (steps_until_due_ > 0) {
    --steps_until_due_;
    return;
  }
  steps_until_due_ = sampling_.hold - 1;
  command->tau = law_.CalcTorque(model().robot(), reading.state.q, reading.state.xi, command->joints);
  command->demand.xi_dot = law_.xi_dot_d();
  command->demand.f_c = law_.ground_forces();
}

}  // namespace dexcheck
