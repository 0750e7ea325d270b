#pragma once

#include <filesystem>
#include <string>

#include "harness/simulation/scenario.h"
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
};

/// The scenario of one trial. @throws InputError as ParseScenario.
Scenario MakeTrialScenario(const StudyInputs& inputs, const Trial& trial);

/// Makes one run. Values that make no run give Outcome::kRefused. Deterministic.
TrialResult RunTrial(const StudyInputs& inputs, const Trial& trial);

/// Parses what the ends of all ranges make of the scenario, and sets up the first trial, so that a mistake is
/// found before anything runs. @throws InputError.
void CheckTrials(const StudyInputs& inputs);

}  // namespace dexcheck
