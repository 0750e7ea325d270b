#pragma once

#include "controller/control/controller.h"
#include "controller/handling/handling_controller.h"
#include "controller/handling/pick_and_place.h"

namespace dexcheck {

/// The task of PickAndPlace by the law of HandlingController. Before Begin the hand keeps its posture, open
/// and without contact. Allocates where a phase or a movement begins, and where a set of contacts comes up
/// for the first time.
class PickAndPlaceController final : public Controller {
 public:
  /// @param options the posture is that of the start, in q_start; orientation must be kRotation.
  /// @param time_step at the middle of which velocities are referred to (leapfrog), s; 0 for none.
  /// Else as PickAndPlace and HandlingController; all must outlive this.
  PickAndPlaceController(const RobotModel& model, const Hand& hand, const MassProperties& object,
                         const Surface& surface, const GraspControllerOptions& options,
                         const VectorXd& q_start, const PickAndPlaceOptions& task, double time_step);

  void Follow(const Trajectory& /*motion*/) override {}
  void Begin(double t, const Reading& reading) override;
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] bool is_done() const override { return task_.is_done(); }
  [[nodiscard]] const GraspModel& model() const override { return model_; }

  [[nodiscard]] const PickAndPlace& task() const { return task_; }
  /// Largest change of a torque from one step to the next where the phase or the contacts changed, N m.
  [[nodiscard]] double torque_jump() const { return torque_jump_; }

 private:
  void CalcTorque(const Reading& reading);
  void Describe(Command* command) const;

  GraspControllerOptions options_;
  GraspModel model_;
  HandlingController law_;
  PickAndPlace task_;
  bool begun_ = false;
  double torque_jump_ = 0.0;
  VectorXd sigma_prime_, tau_, tau_before_;  // n
};

}  // namespace dexcheck
