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
  std::shared_ptr<const mjModel> engine;  ///< The MJCF compiled, for all trials; none before CheckTrials.
  /// The parameter file read with these overrides, for the trials that have no others; likewise.
  std::shared_ptr<const RobotModel> model;
  std::vector<std::string> model_overrides;
  std::shared_ptr<const TomlDocument>
      model_document;  ///< The parameter file parsed, for the others; likewise.
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
