#pragma once

// Studies of the shipped scenarios, and rows for their trials.

#include <string>

#include "controller/common/toml_reader.h"
#include "harness/study/study_store.h"
#include "harness/study/trial.h"
#include "tests/common/paths.h"

namespace dexcheck::testing {

/// A study of a shipped scenario, with the shipped robot or the Panda.
inline StudyInputs MakeStudyInputs(const std::string& text) {
  StudyInputs inputs;
  inputs.study = ParseStudy(text, "study.toml");
  inputs.scenario_source = inputs.study.scenario;
  inputs.scenario_folder = SourcePath("/harness/shipped/scenarios");
  inputs.scenario_text = ReadTextFile((inputs.scenario_folder / (inputs.study.scenario + ".toml")).string());
  const bool is_panda = inputs.study.scenario.starts_with("panda");
  inputs.robot = SourcePath("/controller/parameters/") + (is_panda ? "panda.toml" : "assistant_robot.toml");
  inputs.mjcf = SourcePath("/mjcf/") + (is_panda ? "panda_scene.xml" : "scene.xml");
  return inputs;
}

/// A row of a trial that tracked; all of its metrics are this number.
inline TrialRow MakeTrialRow(const Trial& trial, double metric = 0.0) {
  TrialRow row;
  row.trial = trial;
  row.result.metrics.fill(metric);
  return row;
}

/// Returns a database's identity of a study, with one text in all other columns.
inline StudyIdentity MakeIdentity(const Study& study, const std::string& other = "text") {
  return {{"layout", kStudyLayout},   {"name", study.name},
          {"study", study.text},      {"scenario", other},
          {"robot", other},           {"mjcf_hash", other},
          {"controller_hash", other}, {"dexcheck_version", other},
          {"git_revision", other},    {"mujoco_version", other}};
}

}  // namespace dexcheck::testing
