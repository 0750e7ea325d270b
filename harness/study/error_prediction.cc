#include "harness/study/error_prediction.h"

#include "harness/run/loop_parts.h"

namespace dexcheck {

ErrorPrediction::ErrorPrediction(const Setup& setup, bool acts_at_rest)
    : sensing_(setup.scenario().imperfections.sensing, setup.MakePartContext()),
      drive_(MakeLoopParts(setup).plant->motors(), setup.scenario().imperfections.actuation,
             setup.MakePartContext()),
      disturbances_(setup.scenario().imperfections.disturbances, setup.MakePartContext()),
      trajectory_(setup.scenario().trajectory(setup.X_start() + setup.scenario().start_error)),
      controller_(MakeLoopParts(setup).controller),
      model_(setup.known_model(), setup.fingertips(), setup.known_model().object()->body, setup.surface(),
             setup.MakeControllerOptions()),
      dynamics_(setup.known_model(), static_cast<int>(setup.fingertips().size())),
      actuation_(setup.model()),
      K_p_(setup.scenario().control.gains.K_p.head<3>()),
      K_v_(setup.scenario().control.gains.K_v.head<3>()),
      time_step_(setup.scenario().plant.time_step),
      acts_at_rest_(acts_at_rest) {
  force_.setZero(setup.model().num_velocities());
  command_.tau = force_;
  controller_->Follow(*trajectory_);
}

Vector3d ErrorPrediction::CalcAcceleration(const StepRecord& ideal) {
  const MeasuredState& truth = ideal.reading.state;
  sensing_.Tell(ideal.reading, &told_);
  controller_->Step(told_, ideal.time, &command_);
  drive_.Drive(command_.tau, truth.xi, &tau_);
  actuation_.CalcForce(tau_, force_);
  const std::span<const Wrench> wrenches = disturbances_.Evaluate(ideal.time, truth);
  model_.SetState(truth);
  AddRobotForce(wrenches, model_.robot(), force_);
  const Vector6d push = CalcObjectWrench(wrenches, truth.X_Bo);
  const Vector6d& V_Bo_dot =
      dynamics_.Predict(model_.robot(), model_.grasp(), force_, ObjectSupport::kHand, nullptr, &push)
          .V_Bo_dot;
  // p_ddot = R (v_dot + omega x v)
  const Vector3d v = truth.V_Bo.head<3>(), omega = truth.V_Bo.tail<3>();
  return truth.X_Bo.linear() * (V_Bo_dot.head<3>() + omega.cross(v));
}

void ErrorPrediction::Step(const Vector3d& d) {
  if (errors_.empty() && acts_at_rest_) e_ = (K_p_ > 0.0).select(-d.array() / K_p_, 0.0);
  errors_.push_back(e_);
  e_dot_ -= time_step_ * (K_v_ * e_dot_.array() + K_p_ * e_.array() + d.array()).matrix();
  e_ += time_step_ * e_dot_;
}

}  // namespace dexcheck
