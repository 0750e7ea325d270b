#include "harness/cli/study_files.h"

#include <filesystem>

#include "controller/common/toml_reader.h"
#include "harness/cli/run_folder.h"
#include "harness/cli/shipped_files.h"

namespace dexcheck::cli {
StudyInputs FindStudy(const std::string& name_or_file) {
  const std::filesystem::path path = kStudies.Find(name_or_file);
  StudyInputs inputs;
  inputs.study = ParseStudy(ReadTextFile(path.string()), path.string());
  const std::string& scenario = inputs.study.scenario;
  const std::string file = IsTomlFile(scenario) ? (path.parent_path() / scenario).string() : scenario;
  const ScenarioFiles files = FindScenario(file, inputs.study.overrides, 0);
  inputs.scenario_text = files.scenario.text;
  inputs.scenario_source = scenario;
  inputs.scenario_folder = std::filesystem::path(files.scenario.source).parent_path();
  inputs.robot = files.robot;
  inputs.mjcf = files.mjcf;
  return inputs;
}

}  // namespace dexcheck::cli
