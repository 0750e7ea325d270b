#include "harness/cli/study_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/cli/run_folder.h"
#include "harness/cli/shipped_files.h"
#include "harness/common/shell.h"

namespace dexcheck::cli {
namespace {

constexpr const char* kStudyFolder = "harness/studies";

bool IsFile(const std::string& name) {
  return name.ends_with(".toml") || name.find('/') != std::string::npos;
}

std::filesystem::path FindStudyFile(const std::string& name) {
  if (IsFile(name)) return name;
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

StudyInputs FindStudy(const std::string& name_or_file) {
  const std::filesystem::path path = FindStudyFile(name_or_file);
  StudyInputs inputs;
  inputs.study = ParseStudy(ReadTextFile(path.string()), path.string());
  const std::string& scenario = inputs.study.scenario;
  const std::string file = IsFile(scenario) ? (path.parent_path() / scenario).string() : scenario;
  const ScenarioFiles files = FindScenario(file, inputs.study.overrides, 0);
  inputs.scenario_text = files.scenario.text;
  inputs.scenario_source = scenario;
  inputs.scenario_folder = std::filesystem::path(files.scenario.source).parent_path();
  inputs.robot = files.robot;
  inputs.mjcf = files.mjcf;
  return inputs;
}

std::string MakeSlurmScript(const StudyInputs& inputs, const std::string& name_or_file, std::uint64_t tasks) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::string study = IsFile(name_or_file)
                                ? std::filesystem::absolute(name_or_file).lexically_normal().string()
                                : name_or_file;
  const std::string& name = inputs.study.name;
  return fmt::format(
      R"(#!/bin/bash
# Makes the study {name} in {tasks} tasks: sbatch THIS_FILE. Each task writes a database into the folder that the job
# is submitted from; a task that was killed goes on where it was when it is requeued. When all are done:
#   {program} study merge {name}.sqlite {name}-*-of-{tasks}.sqlite
#SBATCH --job-name={name}
#SBATCH --array=1-{tasks}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output={name}-%a-of-{tasks}.log
exec {program} study run {study} --quiet --jobs "${{SLURM_CPUS_PER_TASK:-1}}" \
  --shard "$SLURM_ARRAY_TASK_ID/{tasks}" --db "{name}-$SLURM_ARRAY_TASK_ID-of-{tasks}.sqlite"
)",
      fmt::arg("name", name), fmt::arg("tasks", tasks), fmt::arg("program", QuoteForShell(program)),
      fmt::arg("study", QuoteForShell(study)));
}

}  // namespace dexcheck::cli
