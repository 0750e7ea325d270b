#include "controller/handling/pick_and_place_controller.h"

#include <algorithm>

#include "controller/object/so3.h"

namespace dexcheck {

PickAndPlaceController::PickAndPlaceController(const RobotModel& model, const Hand& hand,
                                               const MassProperties& object, const Surface& surface,
                                               const GraspControllerOptions& options, const VectorXd& q_start,
                                               const PickAndPlaceOptions& task, double time_step)
    : options_(options),
      model_(model, hand.fingertips, object, surface, options),
      law_(model, hand.fingertips, object, surface, options),
      task_(model, hand, surface, object, q_start, task, time_step) {
  Require(options.orientation == OrientationFeedback::kRotation, "orientation", "must be kRotation",
          options.orientation);
  sigma_prime_.setZero(model.num_velocities());
  tau_ = tau_before_ = sigma_prime_;
}

void PickAndPlaceController::Begin(double t, const Reading& reading) {
  task_.Begin(t, reading.state);
  begun_ = true;
}

void PickAndPlaceController::CalcTorque(const Reading& reading) {
  tau_ = law_.CalcTorque(model(), reading.state, task_.demand(), sigma_prime_);
}

void PickAndPlaceController::Step(const Reading& reading, double t, Command* command) {
  const ContactSet contacts_before = task_.demand().contacts;
  const Phase phase_before = task_.phase();
  command->desired = DesiredMotion{};
  if (begun_) task_.Update(t, reading.state, reading.touch);
  Describe(command);
  model_.SetState(reading.state);
  const PostureTask& posture = begun_ ? task_.posture() : options_.posture;
  posture.CalcAcceleration(reading.state.q, reading.state.xi, sigma_prime_);
  tau_before_ = tau_;
  try {
    CalcTorque(reading);
  } catch (const GraspForceError& error) {
    if (task_.phase() != Phase::kGrip && task_.phase() != Phase::kTakeOver) throw;
    task_.Refuse(t, error.what());
    Describe(command);
    CalcTorque(reading);
  }
  const bool switched = task_.phase() != phase_before || task_.demand().contacts != contacts_before;
  if (begun_ && switched) torque_jump_ = std::max(torque_jump_, (tau_ - tau_before_).cwiseAbs().maxCoeff());

  command->tau = tau_;
  command->desired = task_.demand().desired;
  if (!task_.demand().carried) {
    command->desired = DesiredMotion{};
    command->desired.X_d << reading.state.X_Bo.translation(), CalcAnyZyzAngles(reading.state.X_Bo.linear());
  }
  command->force_seconds = law_.force_seconds();
  command->force_solves = task_.demand().grip > 0.0 ? 1 : 0;
  command->demand.V_Bo_dot = law_.V_Bo_dot();
  command->demand.xi_dot = law_.xi_dot_d();
  command->demand.f_c = law_.f_c();
  command->demand.F_N.setZero(law_.f_c().size());
}

void PickAndPlaceController::Describe(Command* command) const {
  command->tracks = task_.phase() == Phase::kCarry;
  command->handling = {
      .partial = true, .holding = begun_ && IsHolding(task_.phase()), .contacts = task_.demand().contacts};
  command->task = {static_cast<int>(task_.phase()), task_.demand().weight};
}

}  // namespace dexcheck
