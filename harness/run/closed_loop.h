#pragma once

// The loop of plant and controller, cross-checked at every step.

#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "controller/control/controller.h"
#include "controller/control/trajectory.h"
#include "harness/checks/run_checks.h"
#include "harness/checks/step_record.h"
#include "harness/diagnosis/step_store.h"
#include "harness/plant/disturbances.h"
#include "harness/plant/motor_drive.h"
#include "harness/plant/plant.h"
#include "harness/plant/sensing.h"
#include "harness/run/loop_parts.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// A fingertip left the object.
class GraspLost : public RunFailure {
 public:
  using RunFailure::RunFailure;
};

/// Time spent in each part, s.
struct LoopTimes {
  double plant = 0.0;
  double controller = 0.0;   ///< Includes reading the plant.
  double grasp_force = 0.0;  ///< Part of controller.
  double cross_check = 0.0;  ///< Includes reading the plant's response.
  long solves = 0;           ///< Grasp-force problems.
};

/// One run:
///
///   plant --PlantReading--> sensing --Reading--> controller --Command--> motors --tau'--> plant <-- pushes
///     `----PlantResponse----> checks: all of it is one StepRecord
///
/// Deterministic. Nothing allocates in a step, except in the controller and RunChecks as they state.
class ClosedLoop {
 public:
  /// @param check whether to cross-check.
  /// @throws InputError when the scenario's demands cannot be met.
  ClosedLoop(const Setup& setup, bool check) : ClosedLoop(setup, check, MakeLoopParts(setup)) {}
  /// Makes the loop with other parts than the scenario's own.
  ClosedLoop(const Setup& setup, bool check, LoopParts parts);

  /// Holds the object until everything has come to rest (and then moves on, for a moving start): call once,
  /// before the first Step, at t = 0.
  /// @param should_stop asked before each step of settling.
  /// @return whether everything came to rest; false when it was stopped before. @throws as Step.
  bool Settle(const std::function<bool()>& should_stop = [] { return false; });

  /// Sets the function that gets each step once its checks are made, also one that fails after the first.
  void SetObserver(std::function<void(const StepRecord&)> observe) { observe_ = std::move(observe); }
  /// Makes one step. @throws RunFailure, DivergenceError, GraspForceError, SingularityError. The values of
  /// the step up to then can be read.
  void Step();

  /// The last step, at a fixed address. Its findings come with its checks.
  [[nodiscard]] const StepRecord& record() const { return record_; }
  /// Number of steps of the scenario's duration, the most that a task may take.
  [[nodiscard]] long num_steps() const { return num_steps_; }
  /// Whether the run is complete.
  [[nodiscard]] bool is_finished() const { return record_.step >= num_steps_ || controller_->is_done(); }
  /// Time of the next step's beginning, s.
  [[nodiscard]] double time() const { return static_cast<double>(record_.step) * plant_->time_step(); }

  [[nodiscard]] bool is_checking() const { return checks_.has_value(); }
  /// Only when checking.
  [[nodiscard]] const RunChecks& checks() const { return checks_.value(); }
  /// The steps that differ. Only when checking.
  [[nodiscard]] const StepStore& store() const { return store_.value(); }
  /// Those of settling, if a check failed there that always holds; null otherwise.
  [[nodiscard]] const StepStore* settling_store() const {
    return settling_store_ ? &*settling_store_ : nullptr;
  }
  /// The controller of a task; null unless the scenario is one.
  [[nodiscard]] const PickAndPlaceController* task() const { return task_; }
  [[nodiscard]] const LoopTimes& times() const { return times_; }
  /// Whether the controller's law is the scenario's.
  [[nodiscard]] bool knows_law() const { return knows_law_; }
  [[nodiscard]] std::span<const Motor> motors() const { return plant_->motors(); }
  /// Largest drift of a controller that follows its contacts, over all of them and all steps.
  [[nodiscard]] const ContactDrift& largest_drift() const { return largest_drift_; }

 private:
  void CheckMovingStart() const;
  bool StartMoving(const Vector3d& v, const std::function<bool()>& should_stop);
  /// @param end of settling, s.
  bool SettleOn(const Trajectory& motion, double duration, double end,
                const std::function<bool()>& should_stop);
  void BeginRun();
  /// Makes ControlStep as far as it comes.
  void MakeStep(double t);
  /// Lets time begin anew for checks and causes.
  void ForgetSteps(RunChecks::Keep keep = RunChecks::Keep::kAll);
  /// Makes all checks of a step of the run.
  void Check();
  void Observe() const;
  void ControlStep(double t);
  void DriveMotors(double t);
  void CheckRobot() const;
  void CheckGrasp();
  void CheckTask() const;

  const Setup* setup_;
  std::unique_ptr<Plant> plant_;
  Sensing sensing_;
  std::function<void(double t, MeasuredState* measured)> hidden_sensor_fault_;
  std::unique_ptr<Controller> controller_;
  const PickAndPlaceController* task_ = nullptr;    // is controller_, or null
  const TrajectoryController* follower_ = nullptr;  // is controller_, or null
  MotorDrive drive_;
  Disturbances disturbances_;
  std::optional<RunChecks> checks_;
  std::optional<StepStore> store_, settling_store_;
  std::unique_ptr<Trajectory> trajectory_;  // null for a task or a motion of joints
  StepRecord record_;
  std::function<void(const StepRecord&)> observe_;
  bool knows_law_;
  long num_steps_ = 0;
  bool is_running_ = false;  // all has settled
  long steps_without_grasp_ = 0;
  bool is_driven_ = false;  // whether the step's torques were sent
  LoopTimes times_;
  ContactDrift largest_drift_;
};

}  // namespace dexcheck
