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

/// Errors by step: of the object's position (3), m, or of joints (n), rad or m.
struct Errors {
  std::vector<double> values;  ///< One step behind the other.
  size_t size = 3;             ///< Numbers of a step.
  void Append(const VectorXd& error) {
    size = static_cast<size_t>(error.size());
    values.insert(values.end(), error.begin(), error.end());
  }
  [[nodiscard]] size_t CountSteps() const { return values.size() / size; }
  [[nodiscard]] Eigen::Map<const VectorXd> At(size_t step) const {
    return {values.data() + step * size, static_cast<Eigen::Index>(size)};
  }
};

/// What a plant that is not ideal makes of the tracking error, to first order: along the run of an ideal one
/// it computes at each step what would be measured, what the law would send then, what the motors would
/// deliver, and how the rigid system (19), (46), (48) with the plant's own masses and pushes would
/// accelerate. That acceleration less the ideal one, d, drives the error. Of the object's position, with the
/// gains of (57),
///
///   e_ddot + K_v e_dot + K_p e = -d,   e = X_d - X_o
///
/// and likewise of the joints that follow a motion of their own, e = q_d - q, by computed torque. The other
/// laws of joints leave e_ddot = -d - M^-1 (K e + D e_dot).
class ErrorPrediction {
 public:
  /// @param setup of the scenario with its imperfections; outlives this.
  /// @param acts_at_rest whether the run begins with the error that the first d has in the end.
  ErrorPrediction(const Setup& setup, bool acts_at_rest);

  /// Acceleration at a step of the ideal run: of the object's origin, world (3), m/s^2, or of the joints (n).
  /// Once at each step.
  const VectorXd& CalcAcceleration(const StepRecord& ideal);
  /// One step of the error. @param d as CalcAcceleration.
  void Step(const VectorXd& d);
  /// The error at each step, less that of the ideal run.
  [[nodiscard]] const Errors& errors() const { return errors_; }

 private:
  Sensing sensing_;
  MotorDrive drive_;
  Disturbances disturbances_;
  std::unique_ptr<Trajectory> trajectory_;
  std::unique_ptr<Controller> controller_;
  GraspModel model_;
  ConstrainedDynamics dynamics_;
  ActuationMap actuation_;
  const JointMotion* joint_motion_;  // null of an object
  bool is_decoupled_ = true;         // the error's dynamics have gains of their own
  Reading measured_;
  Command command_;
  VectorXd tau_, force_;      // n
  Eigen::ArrayXd K_p_, K_v_;  // or K, D
  double time_step_;
  bool acts_at_rest_;
  bool has_begun_ = false;
  VectorXd acceleration_, e_, e_dot_, e_ddot_;
  Errors errors_;
};

}  // namespace dexcheck
