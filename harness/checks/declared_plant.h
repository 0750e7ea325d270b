#pragma once

// The plant that a scenario declares (faults of sensing and motors, pushes, other masses), computed a second
// time beside the loop: declared causes raise no alarm, and faults that the scenario hides are still found.

#include <span>

#include "controller/control/controller.h"
#include "controller/control/grasp_terms.h"
#include "harness/checks/step_record.h"
#include "harness/plant/disturbances.h"
#include "harness/plant/motor_drive.h"
#include "harness/plant/sensing.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Declared effects of one step. For an ideal plant they are the loop's own values.
struct DeclaredStep {
  bool is_ideal = true;           ///< Nothing is declared.
  Reading measured;               ///< Measurement that the declared sensing makes of the true state.
  bool is_measured_right = true;  ///< Whether the loop measured the same.
  VectorXd tau;                   ///< Torques that the declared motors make of the command, tau' (n), N m.
  const GraspModel* model = nullptr;          ///< Terms of the plant's declared masses, at the true state.
  VectorXd force;                             ///< Declared pushes on the robot, as forces on xi (n).
  Vector6d object_wrench = Vector6d::Zero();  ///< Declared pushes on the object, Sigma_o.
  /// All declared pushes, where they act on the plant's bodies.
  std::span<const Wrench> pushes;
};

/// Follows a loop with all that its scenario declares. Nothing allocates after the first step.
class DeclaredPlant {
 public:
  /// @throws InputError when the scenario names a part that is not there.
  DeclaredPlant(const Setup& setup, std::span<const Motor> motors);

  /// Whether nothing is declared.
  [[nodiscard]] bool is_ideal() const { return step_.is_ideal; }
  /// Follows one step, including those while everything comes to rest. @param step its command is set.
  const DeclaredStep& Follow(const StepRecord& step);
  /// Moves robot and object by `way` (m, world) from now on.
  void Translate(const Vector3d& way) { sensing_.Translate(way); }
  /// Adds `v` (m/s, world) to the velocity of robot and object from now on.
  void AddVelocity(const Vector3d& v) { sensing_.AddVelocity(v); }

 private:
  Sensing sensing_;
  MotorDrive drive_;
  Disturbances disturbances_;
  GraspModel model_;
  DeclaredStep step_;
};

}  // namespace dexcheck
