#include "controller/control/trajectory_controller.h"

#include <stdexcept>

#include "controller/common/errors.h"

namespace dexcheck {

TrajectoryController::TrajectoryController(const RobotModel& model, std::span<const int> fingertips,
                                           const MassProperties& object, const Surface& surface,
                                           const GraspControllerOptions& options, const Sampling& sampling)
    : law_(model, fingertips, object, surface, options), sampling_(sampling) {
  if (sampling.contacts) follower_.emplace(model, fingertips, surface, *sampling.contacts);
  Require(sampling.hold > 0, "sampling.hold", "must be positive", sampling.hold);
}

void TrajectoryController::Follow(const Trajectory& motion) {
  motion_ = &motion;
  steps_until_due_ = 0;
}

void TrajectoryController::Begin(double /*t*/, const Reading& /*reading*/) { has_begun_ = true; }

DesiredMotion TrajectoryController::EvaluateDesired(const Trajectory& motion, double t, double time_step) {
  DesiredMotion desired = motion.Evaluate(t);
  // Semi-implicit Euler steps like a leapfrog: velocities belong to the middle of the step before.
  desired.X_d_dot = motion.Evaluate(t - 0.5 * time_step).X_d_dot;
  return desired;
}

void TrajectoryController::Step(const Reading& reading, double t, Command* command) {
  if (motion_ == nullptr) throw std::logic_error("TrajectoryController: Step before Follow");
  command->tracks = true;
  command->handling = Handling{};
  command->force_seconds = 0.0;
  command->force_solves = 0;
  command->desired = EvaluateDesired(*motion_, t, sampling_.time_step);
  if (follower_ && has_begun_) {
    followed_ = reading.state;
    followed_.kappa = follower_->Follow(reading.state);
    law_.SetState(followed_);
  } else {
    law_.SetState(reading.state);
  }
  if (steps_until_due_ > 0) {
    --steps_until_due_;
    return;
  }
  steps_until_due_ = sampling_.hold - 1;
  command->tau = law_.CalcTorque(command->desired);
  command->force_seconds = law_.force_seconds();
  command->force_solves = 1;
  command->demand.V_Bo_dot = law_.V_Bo_dot();
  command->demand.xi_dot = law_.law().xi_dot_d();
  command->demand.f_c = law_.law().f_c();
  command->demand.F_N = law_.F_N();
}

}  // namespace dexcheck
