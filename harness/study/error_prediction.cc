#include "harness/study/error_prediction.h"

#include "harness/run/loop_parts.h"

namespace dexcheck {
namespace {

GraspModelOptions MakeModelOptions(const Setup& setup) {
  if (setup.joints() != nullptr) return {.orientation = OrientationFeedback::kRotation};
  const GraspControllerOptions controller = setup.MakeControllerOptions();
  return static_cast<const GraspModelOptions&>(controller);
}

}  // namespace

ErrorPrediction::ErrorPrediction(const Setup& setup, bool acts_at_rest)
    : sensing_(setup.scenario().imperfections.sensing, setup.MakePartContext()),
      drive_(MakeLoopParts(setup).plant->motors(), setup.scenario().imperfections.actuation,
             setup.MakePartContext()),
      disturbances_(setup.scenario().imperfections.disturbances, setup.MakePartContext()),
      controller_(MakeLoopParts(setup).controller),
      model_(setup.declared_model(), setup.fingertips(), setup.declared_object().body, setup.surface(),
             MakeModelOptions(setup)),
      dynamics_(setup.declared_model(), static_cast<int>(setup.fingertips().size())),
      actuation_(setup.model()),
      joint_motion_(setup.joints() == nullptr ? nullptr : &setup.joints()->motion),
      time_step_(setup.scenario().plant.time_step),
      acts_at_rest_(acts_at_rest) {
  force_.setZero(setup.model().num_velocities());
  command_.tau = force_;
  if (joint_motion_ == nullptr) {
    trajectory_ = setup.MakeTrajectory();
    controller_->Follow(*trajectory_);
    K_p_ = setup.scenario().control.gains.K_p.head<3>();
    K_v_ = setup.scenario().control.gains.K_v.head<3>();
  } else {
    const JointGains& gains = setup.joints()->gains;
    is_decoupled_ = setup.scenario().control.law == ControlLaw::kComputedTorque;
    K_p_ = is_decoupled_ ? gains.K_p : gains.K;
    K_v_ = is_decoupled_ ? gains.K_v : gains.D;
  }
  e_.setZero(K_p_.size());
  e_dot_ = e_ddot_ = acceleration_ = e_;
}

const VectorXd& ErrorPrediction::CalcAcceleration(const StepRecord& ideal) {
  const MeasuredState& true_state = ideal.reading.state;
  sensing_.Measure(ideal.reading, &measured_);
  if (!has_begun_ && joint_motion_ != nullptr) controller_->Begin(ideal.time, measured_);
  has_begun_ = true;
  controller_->Step(measured_, ideal.time, &command_);
  drive_.Drive(command_.tau, true_state.xi, &tau_);
  actuation_.CalcForce(tau_, force_);
  const std::span<const Wrench> wrenches = disturbances_.Evaluate(ideal.time, true_state);
  model_.SetState(true_state);
  AddRobotForce(wrenches, model_.robot(), force_);
  if (joint_motion_ != nullptr) {
    acceleration_ = dynamics_.PredictFree(model_.robot(), force_).xi_dot;
    return acceleration_;
  }
  const Vector6d push = CalcObjectWrench(wrenches, true_state.X_Bo);
  const Vector6d& V_Bo_dot =
      dynamics_.Predict(model_.robot(), model_.grasp(), force_, ObjectSupport::kHand, nullptr, &push)
          .V_Bo_dot;
  // p_ddot = R (v_dot + omega x v)
  const Vector3d v = true_state.V_Bo.head<3>(), omega = true_state.V_Bo.tail<3>();
  acceleration_ = true_state.X_Bo.linear() * (V_Bo_dot.head<3>() + omega.cross(v));
  return acceleration_;
}

void ErrorPrediction::Step(const VectorXd& d) {
  const MatrixXd& M = model_.robot().M();
  if (errors_.values.empty() && acts_at_rest_) {
    const VectorXd at_rest = is_decoupled_ ? d : VectorXd(M * d);
    e_ = (K_p_ > 0.0).select(-at_rest.array() / K_p_, 0.0);
  }
  errors_.Append(e_);
  e_ddot_ = -(K_v_ * e_dot_.array() + K_p_ * e_.array());
  if (!is_decoupled_) {
    // What the springs and dampers add to the forces, M^-1 (force + bias - bias).
    force_ = e_ddot_ + dynamics_.bias();
    e_ddot_ = dynamics_.PredictFree(model_.robot(), force_).xi_dot;
  }
  e_dot_ += time_step_ * (e_ddot_ - d);
  e_ += time_step_ * e_dot_;
}

}  // namespace dexcheck
