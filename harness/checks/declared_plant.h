#pragma once

// What a scenario itself declares of its plant (faults of sensing and motors, pushes, other masses), computed
// a second time beside the loop: declared causes raise no alarm, and what is hidden from the scenario is
// still found.

#include <span>

#include "controller/control/controller.h"
#include "controller/control/grasp_model.h"
#include "harness/checks/step_record.h"
#include "harness/plant/disturbances.h"
#include "harness/plant/motor_drive.h"
#include "harness/plant/sensing.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// What is declared of one step. Of an ideal plant that is what the loop itself has.
struct DeclaredStep {
  bool is_ideal = true;               ///< Nothing is declared.
  Reading measured;                   ///< What the declared sensing makes of the true state.
  bool is_measured_right = true;      ///< Whether that is what was measured.
  VectorXd tau;                       ///< What the declared motors make of the command, tau' (n), N m.
  const GraspModel* model = nullptr;  ///< Terms of the plant's declared masses, at the true state.
  VectorXd force;                     ///< Declared pushes on the robot, as forces on xi (n).
  Vector6d object_wrench = Vector6d::Zero();  ///< And on the object, Sigma_o.
  /// All of them, where they act on the plant's bodies.
  std::span<const Wrench> pushes;
};

/// Follows a loop with all that its scenario declares. Nothing allocates after the first step.
class DeclaredPlant {
 public:
  /// @throws InputError when the scenario names what is not there.
  DeclaredPlant(const Setup& setup, std::span<const Motor> motors);

  /// Whether nothing is declared.
  [[nodiscard]] bool is_ideal() const { return step_.is_ideal; }
  /// Once at each step, those while everything comes to rest included. @param step its command is set.
  const DeclaredStep& Follow(const StepRecord& step);
  /// Robot and object are elsewhere from now on, by `way` (m, world).
  void Translate(const Vector3d& way) { sensing_.Translate(way); }
  /// They move at `v` (m/s, world) more from now on.
  void AddVelocity(const Vector3d& v) { sensing_.AddVelocity(v); }

 private:
  Sensing sensing_;
  MotorDrive drive_;
  Disturbances disturbances_;
  GraspModel model_;
  DeclaredStep step_;
};

}  // namespace dexcheck
