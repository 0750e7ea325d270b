#include "harness/cli/study_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <regex>

#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/base/console.h"
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

namespace {

bool Matches(const std::string& text, const char* pattern) {
  return std::regex_match(text, std::regex(pattern));
}

}  // namespace

std::string CheckSlurmTime(const std::string& text) {
  if (Matches(text, "\\d{1,9}(-\\d{1,9})?(:\\d{1,9}){0,2}")) return {};
  return "must be MIN, MIN:SEC, HOURS:MIN:SEC or DAYS-HOURS[:MIN[:SEC]], got " + Quote(text);
}

std::string CheckSlurmMemory(const std::string& text) {
  if (Matches(text, "\\d{1,9}[KMGT]?")) return {};
  return "must be a whole number with K, M, G or T, got " + Quote(text);
}

std::string MakeSlurmScript(const StudyInputs& inputs, const std::string& name_or_file, const SlurmJob& job) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::string study = IsTomlFile(name_or_file)
                                ? std::filesystem::absolute(name_or_file).lexically_normal().string()
                                : name_or_file;
  const std::string& name = inputs.study.name;
  std::string more;
  if (!job.time.empty()) more += "#SBATCH --time=" + job.time + "\n";
  if (!job.memory.empty()) more += "#SBATCH --mem=" + job.memory + "\n";
  return fmt::format(
      R"(#!/bin/bash
# Makes the study {name} in {tasks} tasks: sbatch THIS_FILE. Each task writes a database into the folder that the job
# is submitted from; a task that was killed goes on where it was when it is requeued. When all are done:
#   {program} study merge {name}.sqlite {name}-*-of-{tasks}.sqlite
#SBATCH --job-name={name}
#SBATCH --array=1-{elements}{throttle}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={cpus}
{more}#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output={name}-%a-of-{elements}.log
# The array has {elements} elements; each makes every {elements}th task, from the one of its own number on.
code=0
for ((task = SLURM_ARRAY_TASK_ID; task <= {tasks}; task += {elements})); do
  {program} study run {study} --quiet --jobs "${{SLURM_CPUS_PER_TASK:-1}}" \
    {shard}--db "{name}-$task-of-{tasks}.sqlite" || code=$?
done
exit $code
)",
      fmt::arg("name", name), fmt::arg("tasks", job.tasks),
      fmt::arg("elements", std::min(job.tasks, job.array_size)),
      fmt::arg("throttle", job.throttle > 0 ? "%" + std::to_string(job.throttle) : ""),
      fmt::arg("cpus", job.cpus), fmt::arg("more", more),
      fmt::arg("shard", inputs.study.is_search() ? "" : fmt::format("--shard \"$task/{}\" ", job.tasks)),
      fmt::arg("program", QuoteForShell(program)), fmt::arg("study", QuoteForShell(study)));
}

}  // namespace dexcheck::cli
