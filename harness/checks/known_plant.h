#pragma once

// What a scenario itself asks for (faults of sensing and motors, pushes, other masses), computed a second
// time beside the loop: causes that are known cry no wolf, and what is hidden from the scenario is still
// found.

#include "controller/control/controller.h"
#include "controller/control/grasp_model.h"
#include "harness/plant/disturbances.h"
#include "harness/plant/motor_drive.h"
#include "harness/plant/sensing.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

struct StepRecord;

/// What is known of one step.
struct KnownStep {
  Reading told;                               ///< What the scenario's sensing makes of the truth.
  VectorXd tau;                               ///< What its motors make of the command, tau' (n), N m.
  const GraspModel* model = nullptr;          ///< Terms of the plant's own masses, at the truth.
  VectorXd force;                             ///< Its pushes on the robot, as forces on xi (n).
  Vector3d push = Vector3d::Zero();           ///< Sum of those forces, world, N.
  Vector6d object_wrench = Vector6d::Zero();  ///< And on the object, Sigma_o.
};

/// Follows a loop whose plant is not the ideal one. Nothing allocates after the first step.
class KnownPlant {
 public:
  /// @throws InputError when the scenario names what is not there.
  KnownPlant(const Setup& setup, std::span<const Motor> motors);

  /// Once at each step, those while everything comes to rest included. @param step its command is set.
  const KnownStep& Follow(const StepRecord& step);
  /// One more push is asked for from now on.
  void Expect(const DisturbanceOptions& disturbance, const PartContext& context) {
    disturbances_.Add(disturbance, context);
  }
  /// Robot and object are elsewhere from now on, by `way` (m, world).
  void Translate(const Vector3d& way) { sensing_.Translate(way); }
  /// They move at `v` (m/s, world) more from now on.
  void AddVelocity(const Vector3d& v) { sensing_.AddVelocity(v); }

 private:
  Sensing sensing_;
  MotorDrive drive_;
  Disturbances disturbances_;
  GraspModel model_;
  KnownStep known_;
};

}  // namespace dexcheck
