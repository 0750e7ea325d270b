#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "controller/model/robot_model.h"
#include "harness/engine/engine.h"
#include "harness/scenario/scenario.h"
#include "harness/study/study.h"
#include "harness/study/trial_result.h"

namespace dexcheck {

class TomlDocument;

/// A study with the files that its trials take.
struct StudyInputs {
  Study study;
  std::string scenario_text;
  std::string scenario_source;  ///< For messages, the same on every machine.
  std::filesystem::path scenario_folder;
  std::filesystem::path robot;
  std::filesystem::path mjcf;
  // What all trials have, made once by CheckTrials; without it each trial makes its own.
  std::shared_ptr<const mjModel> engine;                      ///< The MJCF compiled.
  std::shared_ptr<const ScenarioDocument> scenario_document;  ///< With the study's overrides.
  /// The parameter file parsed, with these overrides: the scenario's own and the study's.
  std::shared_ptr<const TomlDocument> model_document;
  std::vector<std::string> model_overrides;
  std::shared_ptr<const RobotModel> model;  ///< Read from it, of a study that varies no key of it.

  /// Parses the scenario, for MakeTrialScenario. @throws InputError.
  void OpenScenario();
};

/// A run without a start error diverged when its error is above this, rms, m; of joints rad.
constexpr double kLostTrack = 0.01;
constexpr double kLostTrackOfJoints = 0.1;

/// The scenario of one trial. @throws InputError as ParseScenario.
Scenario MakeTrialScenario(const StudyInputs& inputs, const Trial& trial);

/// Makes one run. Values that make no run give Outcome::kRefused. Deterministic.
TrialResult RunTrial(const StudyInputs& inputs, const Trial& trial);

/// Parses what the ends of all ranges make of the scenario, and sets up the first trial, so that a fault is
/// found before anything runs. Compiles the MJCF and reads the robot once, for all. @throws InputError.
void CheckTrials(StudyInputs* inputs);

}  // namespace dexcheck
