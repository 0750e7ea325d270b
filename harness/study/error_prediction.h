#pragma once

#include <memory>
#include <vector>

#include "controller/control/actuation.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/control/controller.h"
#include "controller/control/grasp_model.h"
#include "controller/control/trajectory.h"
#include "harness/checks/step_record.h"
#include "harness/plant/disturbances.h"
#include "harness/plant/motor_drive.h"
#include "harness/plant/sensing.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// What a plant that is not ideal makes of the object's position, to first order: along the run of an ideal
/// one it asks at each step what would be told, what the law would send then, what the motors would give, and
/// how the rigid system (19), (46), (48) with the plant's own masses and pushes would accelerate. By that
/// acceleration less the ideal one, d, (57) is driven:
///
///   e_ddot + K_v e_dot + K_p e = -d,   e = X_d - X_o
class ErrorPrediction {
 public:
  /// @param setup of the scenario with its imperfections; outlives this.
  /// @param acts_at_rest whether the run begins with the error that the first d has in the end.
  ErrorPrediction(const Setup& setup, bool acts_at_rest);

  /// Acceleration of the object's origin at a step of the ideal run, world, m/s^2. Once at each step.
  Vector3d CalcAcceleration(const StepRecord& ideal);
  /// One step of (57). @param d m/s^2.
  void Step(const Vector3d& d);
  /// X_d - X_o at each step, less that of the ideal run, m.
  [[nodiscard]] const std::vector<Vector3d>& errors() const { return errors_; }

 private:
  Sensing sensing_;
  MotorDrive drive_;
  Disturbances disturbances_;
  std::unique_ptr<Trajectory> trajectory_;
  std::unique_ptr<Controller> controller_;
  GraspModel model_;
  ConstrainedDynamics dynamics_;
  ActuationMap actuation_;
  Reading told_;
  Command command_;
  VectorXd tau_, force_;  // n
  Eigen::Array3d K_p_, K_v_;
  double time_step_;
  bool acts_at_rest_;
  Vector3d e_ = Vector3d::Zero(), e_dot_ = Vector3d::Zero();
  std::vector<Vector3d> errors_;
};

}  // namespace dexcheck
