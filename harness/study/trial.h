#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "controller/model/robot_model.h"
#include "harness/engine/engine.h"
#include "harness/run/runner.h"
#include "harness/scenario/scenario.h"
#include "harness/study/objective.h"
#include "harness/study/study.h"

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

/// A finished trial.
struct TrialRow {
  Trial trial;
  TrialResult result;
  std::string machine;  ///< That made it, as DescribeMachine says; empty when that was not recorded.
};

/// The rms error that says how good the trials are: of the object's position, or of a motion of joints.
Metric FindErrorMetric(const std::vector<TrialRow>& rows);

/// Whether two rows of one trial are the same: bit for bit when one machine made both, else within rounding
/// (kMetricTolerance). A run that ended early amplifies rounding until it does: of two such the outcomes are
/// compared.
bool IsSame(const TrialRow& a, const TrialRow& b);

}  // namespace dexcheck
