#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "controller/model/robot_model.h"
#include "harness/engine/engine.h"
#include "harness/run/run_summary.h"
#include "harness/scenario/scenario.h"
#include "harness/study/study.h"
#include "harness/study/trial_result.h"

namespace dexcheck {

/// A study with the files that its trials take.
struct StudyInputs {
  Study study;
  std::string scenario_text;
  std::string scenario_source;  ///< For messages, the same on every machine.
  std::filesystem::path scenario_folder;
  std::filesystem::path robot;
  std::filesystem::path mjcf;
  /// Assignments that make the study's controller, if it names one, the scenario's: as NameController has
  /// them.
  std::vector<std::string> controller;
  std::string controller_hash;  ///< As HashController has it; set by CheckTrials.
  // Parts that all trials have, made once by CheckTrials; without it each trial makes its own.
  std::shared_ptr<const mjModel> engine;                      ///< The MJCF compiled.
  std::shared_ptr<const ScenarioDocument> scenario_document;  ///< With the study's overrides.
  std::shared_ptr<const RobotModel> model;  ///< Of the trials whose scenarios have these overrides.
  std::vector<std::string> model_overrides;
};

/// The study's scenario with its overrides, which trials change. @throws InputError.
ScenarioDocument OpenScenario(const StudyInputs& inputs);

/// The scenario of one trial. @throws InputError as ParseScenario.
Scenario MakeTrialScenario(const StudyInputs& inputs, const Trial& trial);

/// Makes one run. Values that make no run give Outcome::kRefused. Deterministic.
/// @throws Error when a controller of the user's own fails: its process is of no use any more.
TrialResult RunTrial(const StudyInputs& inputs, const Trial& trial);

/// Parses what the ends of all ranges make of the scenario, and sets up the first trial, so that a fault is
/// found before anything runs. Compiles the MJCF and reads the robot once, for all. @throws InputError.
void CheckTrials(StudyInputs* inputs);

// Metrics of a run while it runs, from the plant alone: no cross-check is needed.

/// Watches one run. Nothing allocates after construction.
class TrialMonitor {
 public:
  /// @param num_steps that the run has.
  TrialMonitor(const Setup& setup, long num_steps);

  /// Takes in a step.
  void Record(const StepRecord& step);

  /// Error of the last step: of the object's position, m, or of a motion of joints the largest, rad or m.
  [[nodiscard]] double error() const { return error_; }

  /// All metrics of the steps so far, those of `tracking` included.
  [[nodiscard]] std::array<double, kNumMetrics> CalcMetrics(const TrackingStatistics& tracking) const;

 private:
  void RecordError(const StepRecord& step);
  void RecordSlip(const StepRecord& step);
  void RecordMotors(const StepRecord& step);

  long num_steps_;
  double time_step_;
  bool of_joints_;
  bool has_heading_;
  long steps_ = 0;                         // that were completed
  Vector3d direction_ = Vector3d::Zero();  // of the start error
  double error_ = 0.0;                     // of the last step
  double start_error_ = 0.0;               // m, or rad when the object is only turned
  bool by_position_ = true;
  double settled_since_ = 0.0;  // s
  bool settled_ = false;
  double overshoot_ = 0.0;
  std::array<double, 2> quarter_squares_{};  // first and last quarter
  std::array<long, 2> quarter_steps_{};
  std::vector<Vector3d> fingertip_slips_, wheel_slips_;  // m
  std::vector<int> motor_dofs_;                          // by entry of tau'
  double fingertip_slip_ = 0.0, wheel_slip_ = 0.0, cone_margin_;
  double peak_torque_ = 0.0, peak_effort_ = 0.0, energy_ = 0.0;
};

}  // namespace dexcheck
