#include "harness/cli/study_files.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/cli/run_folder.h"
#include "harness/cli/shipped_files.h"

namespace dexcheck::cli {
namespace {

constexpr const char* kStudyFolder = "harness/shipped/studies";

std::filesystem::path FindStudyFile(const std::string& name) {
  if (IsStudyFile(name)) return name;
  const std::filesystem::path folder = FindShippedFile(kStudyFolder);
  std::vector<std::string> known;
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".toml") known.push_back(entry.path().stem().string());
  }
  std::sort(known.begin(), known.end());
  if (std::find(known.begin(), known.end(), name) != known.end()) return folder / (name + ".toml");
  std::string list;
  for (const std::string& one : known) list += (list.empty() ? "" : ", ") + one;
  const std::string nearest = FindNearest(name, known);
  throw InputError("study " + Quote(name) + ": is neither shipped (" + list + ") nor a TOML file" +
                   (nearest.empty() ? "" : ", did you mean " + Quote(nearest) + "?"));
}

}  // namespace

bool IsStudyFile(const std::string& name) {
  return name.ends_with(".toml") || name.find('/') != std::string::npos;
}

StudyInputs FindStudy(const std::string& name_or_file) {
  const std::filesystem::path path = FindStudyFile(name_or_file);
  StudyInputs inputs;
  inputs.study = ParseStudy(ReadTextFile(path.string()), path.string());
  const std::string& scenario = inputs.study.scenario;
  const std::string file = IsStudyFile(scenario) ? (path.parent_path() / scenario).string() : scenario;
  const ScenarioFiles files = FindScenario(file, inputs.study.overrides, 0);
  inputs.scenario_text = files.scenario.text;
  inputs.scenario_source = scenario;
  inputs.scenario_folder = std::filesystem::path(files.scenario.source).parent_path();
  inputs.robot = files.robot;
  inputs.mjcf = files.mjcf;
  return inputs;
}

}  // namespace dexcheck::cli
