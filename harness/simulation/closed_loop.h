#pragma once

// The loop of plant and controller, cross-checked at every step.

#include <functional>
#include <memory>
#include <string>

#include "controller/control/grasp_controller.h"
#include "controller/control/trajectory.h"
#include "controller/handling/handling_controller.h"
#include "controller/handling/pick_and_place.h"
#include "harness/checks/step_checks.h"
#include "harness/checks/step_model_check.h"
#include "harness/plant/observer.h"
#include "harness/plant/plant.h"
#include "harness/simulation/setup.h"

namespace dexcheck {

/// The simulated robot failed: fell, or reached a motor's limit.
class RunFailure : public Error {
 public:
  using Error::Error;
};

/// A fingertip left the object.
class GraspLost : public RunFailure {
 public:
  using RunFailure::RunFailure;
};

/// Distance of the object from its desired pose.
struct TrackingError {
  Vector3d position = Vector3d::Zero();  ///< X_d - X_o, world, m.
  double orientation = 0.0;              ///< Angle between R_Bo and R_Bd, rad.
};

/// Time spent in each part, s.
struct LoopTimes {
  double plant = 0.0;
  double controller = 0.0;   ///< Reading the plant included.
  double grasp_force = 0.0;  ///< Part of controller.
  double cross_check = 0.0;
  long solves = 0;  ///< Grasp-force problems.
};

/// One run. Deterministic.
class ClosedLoop {
 public:
  /// @param check whether to cross-check.
  /// @throws InputError when the scenario asks for what cannot be.
  ClosedLoop(const Setup& setup, bool check);

  /// Holds the object until all has come to rest (and then moves on, for a moving start): call once, before
  /// the first Step, at t = 0. @throws as Step.
  void Settle();

  /// Number of steps of the scenario's duration, the most that a task may take.
  [[nodiscard]] long num_steps() const { return num_steps_; }
  /// Whether there is nothing left to do.
  [[nodiscard]] bool is_finished() const { return step_ >= num_steps_ || (task_ && task_->is_done()); }
  /// Steps done, and the time that the next one begins at, s.
  [[nodiscard]] long step() const { return step_; }
  [[nodiscard]] double time() const { return static_cast<double>(step_) * plant_.time_step(); }

  /// One step. @throws RunFailure, DivergenceError, GraspForceError, SingularityError. What the step saw up
  /// to then can be read.
  void Step();

  // Of the last step, at its beginning.
  [[nodiscard]] double step_time() const { return step_time_; }
  [[nodiscard]] const MeasuredState& state() const { return state_; }
  [[nodiscard]] const VectorXd& qpos() const { return plant_.step_qpos(); }
  [[nodiscard]] const VectorXd& qvel() const { return qvel_; }
  [[nodiscard]] const DesiredMotion& desired() const { return desired_; }
  [[nodiscard]] const TrackingError& error() const { return error_; }
  [[nodiscard]] const VectorXd& tau() const { return tau_; }
  [[nodiscard]] const GraspController& controller() const { return controller_; }
  [[nodiscard]] const Observer& observer() const { return observer_; }
  [[nodiscard]] const Plant& plant() const { return plant_; }
  [[nodiscard]] bool is_checking() const { return check_; }
  [[nodiscard]] const StepChecks& checks() const { return checks_; }
  /// Checks of the first question, model against engine at the plant's state.
  [[nodiscard]] std::span<const RunCheck> model_checks() const { return model_checks_; }
  /// The sequence of phases; null unless the scenario is a task.
  [[nodiscard]] const PickAndPlace* task() const { return task_.get(); }
  /// Whether the object should follow a trajectory, so that its tracking error means something.
  [[nodiscard]] bool is_tracking() const { return !task_ || task_->phase() == Phase::kCarry; }
  /// Largest change of a torque from one step to the next where a task's phase or contacts changed, N m.
  [[nodiscard]] double torque_jump() const { return torque_jump_; }

  /// Pose of the object; its angles follow the controller's where it uses them.
  [[nodiscard]] Vector6d X_o() const;

  /// Motor with the largest share of its limit at the last step, by its entry of tau', and that share.
  [[nodiscard]] int busiest_motor() const { return busiest_motor_; }
  [[nodiscard]] double effort() const { return effort_; }
  [[nodiscard]] const LoopTimes& times() const { return times_; }

 private:
  void PlaceRobot();
  void CheckMovingStart() const;
  void StartMoving(const DesiredMotion& at_start);
  void SettleOn(const Trajectory& trajectory, double duration);
  void ControlStep(const DesiredMotion& desired, long step, double t);
  [[nodiscard]] DesiredMotion EvaluateDesired(const Trajectory& trajectory, double t) const;
  void CompareModel();
  void CheckRobot() const;
  void CheckTorques(double t);
  void CheckGrasp();
  void CheckTask();
  void CalcTaskTorque(double t);
  [[nodiscard]] Handling DescribeHandling() const;

  const Setup* setup_;
  bool check_;
  Plant plant_;
  Observer observer_;
  GraspController controller_;
  StepChecks checks_;
  std::unique_ptr<StepModelCheck> model_check_;
  std::vector<RunCheck> model_checks_;
  std::unique_ptr<Trajectory> trajectory_;        // null for a task
  std::unique_ptr<HandlingController> handling_;  // null without a task
  std::unique_ptr<PickAndPlace> task_;
  bool task_begun_ = false;
  Touch touch_;
  double torque_jump_ = 0.0;
  long num_steps_ = 0;
  long control_interval_ = 1;
  long step_ = 0;
  double step_time_ = 0.0;
  MeasuredState state_;
  MeasuredState told_;  // what the controller is told
  DesiredMotion desired_;
  TrackingError error_;
  VectorXd tau_, tau_before_, qvel_;
  int busiest_motor_ = 0;
  double effort_ = 0.0;
  long steps_without_grasp_ = 0;
  LoopTimes times_;
};

}  // namespace dexcheck
