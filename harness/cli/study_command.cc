#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/cli/run_folder.h"
#include "harness/run/own_controller.h"
#include "harness/study/study_findings.h"
#include "harness/study/study_runner.h"
#include "harness/study/study_store.h"
#include "harness/study/trial.h"

namespace dexcheck::cli {
namespace {

struct StudyRequest {
  std::string study;
  std::string database;
  std::vector<std::string> databases;  ///< To be merged.
  std::string shard;
  OwnController controller;
  std::uint64_t jobs = 0;
  bool retry_failed = false;
  bool quiet = false;
  long trial = 0;
  std::string out, json_file;
};

/// A study's array job.
struct SlurmJob {
  std::uint64_t tasks = 1;  ///< Parts of the study.
  /// Most elements of the array. Slurm's MaxArraySize, 1001 unless configured, is one more than the largest
  /// index.
  std::uint64_t array_size = 1000;
  std::uint64_t cpus = 1;      ///< Processors of an element, each for a trial at a time.
  std::uint64_t throttle = 0;  ///< Elements at a time; 0 for any.
  std::string time;            ///< As sbatch --time; empty for the partition's.
  std::string memory;          ///< As sbatch --mem; empty for the partition's.
};

/// A shipped study by name, or a TOML file, with its scenario. @param controller in the place of the study's.
/// @throws InputError.
StudyInputs FindStudy(const std::string& name_or_file, const OwnController& controller) {
  const std::filesystem::path path = kStudies.Find(name_or_file);
  StudyInputs inputs;
  std::string text = ReadBytes(path.string());
  if (!controller.run.empty())
    text = ApplyOverrides(text, path.string(), {"controller='''" + controller.run + "'''"});
  inputs.study = ParseStudy(text, path.string());
  inputs.controller = controller.List();
  if (controller.run.empty() && !inputs.study.controller.empty())
    inputs.controller = NameController(inputs.study.controller, path.parent_path());
  const std::string& scenario = inputs.study.scenario;
  const std::string file = IsTomlFile(scenario) ? (path.parent_path() / scenario).string() : scenario;
  std::vector<std::string> overrides = inputs.controller;
  overrides.insert(overrides.end(), inputs.study.overrides.begin(), inputs.study.overrides.end());
  const ScenarioFiles files = FindScenario(file, overrides, 0);
  inputs.scenario_text = files.scenario.text;
  inputs.scenario_source = scenario;
  inputs.scenario_folder = std::filesystem::path(files.scenario.source).parent_path();
  inputs.robot = files.robot;
  inputs.mjcf = files.mjcf;
  return inputs;
}

/// Whether a text is as sbatch's --time or --mem has it.
ValueCheck SlurmValue(const char* pattern, const std::string& demand) {
  return [=](const std::string& text) {
    return std::regex_match(text, std::regex(pattern)) ? "" : demand + ", got " + Quote(text);
  };
}

/// The text of a batch script whose array makes the study, a shard for each task; killed and requeued
/// elements go on where they were.
std::string MakeSlurmScript(const StudyInputs& inputs, const StudyRequest& request, const SlurmJob& job) {
  std::error_code error;
  const std::string program = std::filesystem::read_symlink("/proc/self/exe", error).string();
  std::string study = QuoteForShell(
      IsTomlFile(request.study) ? MakeAbsolute(request.study).lexically_normal().string() : request.study);
  if (const std::string& own = request.controller.run; !own.empty()) {
    const std::filesystem::path file =
        FindControllerFile({.run = own, .folder = CurrentFolder(), .parameters = {}});
    study += " --controller " + QuoteForShell(file.empty() ? own : file.string());
  }
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
      fmt::arg("program", QuoteForShell(program)), fmt::arg("study", study));
}

/// The trials of the shard "I/N"; "" is all.
std::vector<Trial> SelectShard(std::vector<Trial> trials, const std::string& text) {
  if (text.empty()) return trials;
  const size_t slash = std::min(text.find('/'), text.size() - 1);
  const long index = ParseNumber<long>(std::string_view(text).substr(0, slash)).value_or(0);
  const long count = ParseNumber<long>(std::string_view(text).substr(slash + 1)).value_or(0);
  if (index < 1 || index > count)
    throw InputError("--shard: must be I/N with 1 <= I <= N, got " + Quote(text));
  std::erase_if(trials, [&](const Trial& trial) { return trial.number % count != index - 1; });
  return trials;
}

/// "0-3, 7, 9" of trials in their order; a long list ends in "...".
std::string ListNumbers(const std::vector<Trial>& trials) {
  constexpr size_t kMostRanges = 20;
  std::string text;
  size_t ranges = 0;
  for (size_t i = 0; i < trials.size(); ++ranges) {
    if (ranges == kMostRanges) return text + ", ...";
    size_t last = i;
    while (last + 1 < trials.size() && trials[last + 1].number == trials[last].number + 1) ++last;
    text += (text.empty() ? "" : ", ") + std::to_string(trials[i].number);
    if (last > i) text += "-" + std::to_string(trials[last].number);
    i = last + 1;
  }
  return text;
}

/// Forgets trials that failed; of a search also what followed from them.
void RemoveFailed(const Study& study, StudyStore* store) {
  if (!study.is_search()) {
    store->RemoveFailed();
    return;
  }
  for (const TrialRow& row : store->ReadRows()) {
    if (!IsFailed(row.result.outcome)) continue;
    store->RemoveFrom(row.trial.number);
    return;
  }
}

/// The trials that a search would make next, as far as its rows go.
std::vector<Trial> ListNext(const StudyStore& store) {
  SearchHistory history(store.study());
  store.ForEachRow([&](const TrialRow& row) { history.Add(row); });
  return history.ListMissing();
}

int RunStudy(const StudyRequest& request) {
  StudyInputs inputs = FindStudy(request.study, request.controller);
  const Study& study = inputs.study;
  if (study.is_search() && !request.shard.empty())
    throw InputError(
        "--shard: a search needs the results of its earlier trials, so that one command must run it");
  const std::vector<Trial> trials =
      study.is_search() ? std::vector<Trial>() : SelectShard(ListTrials(study), request.shard);
  CheckTrials(&inputs);
  StudyStore store = StudyStore::OpenOrCreate(
      request.database, IdentifyStudy(inputs), study,
      [&](const std::vector<TrialRow>& rows) { return MakesRowsAgain(inputs, rows); });
  if (!request.quiet && !store.change().empty()) fmt::print("{}: {}\n", request.database, store.change());
  CatchInterrupts();
  if (request.retry_failed) RemoveFailed(study, &store);
  ProgressBar bar(study.name, study.is_search() ? CountTrials(study) : static_cast<long>(trials.size()),
                  request.quiet);
  const RunOptions options{CountJobs(request.jobs), IsInterrupted,
                           [&bar](long finished) { bar.Update(finished); }};
  if (study.is_search())
    RunSearch(inputs, options, &store);
  else
    RunTrials(inputs, trials, options, &store);
  bar.Finish();
  // From the file that is there now under this name: what another program removed is not done.
  const StudyStore made = StudyStore::Open(request.database);
  const std::vector<Trial> missing = ListMissing(study.is_search() ? ListNext(made) : trials, made);
  if (!missing.empty()) {
    const char* const why = IsInterrupted() ? "interrupted" : "another process has them";
    if (study.is_search()) {
      throw Error(fmt::format("{}: {} of at most {} trials are done ({}); the same command goes on",
                              request.database, made.ListNumbers().size(), CountTrials(study), why));
    }
    throw Error(fmt::format("{}: {} of {} trials are missing ({}): {}; the same command goes on with them",
                            request.database, missing.size(), trials.size(), why, ListNumbers(missing)));
  }
  if (request.quiet) return kSuccess;
  fmt::print("{}\n", Wrap(DescribeProgress(made), 2));
  fmt::print("{}", MakeGainCard(inputs, made.ReadRows(0, /*with_machine=*/false)));
  const std::map<Outcome, long> outcomes = made.CountOutcomes();
  if (outcomes.count(Outcome::kCrashed) + outcomes.count(Outcome::kTimedOut) > 0) {
    fmt::print("Trials that crashed or timed out are made again with --retry-failed.\n");
  }
  return kSuccess;
}

/// Adds to a database that is there, or makes one under a temporary name that it loses when it is complete.
void AddToDatabase(const std::string& path, const StudyStore& like, const std::vector<std::string>& sources) {
  const auto add = [&](const std::filesystem::path& database) {
    StudyStore store = StudyStore::OpenOrCreate(database, like.identity(), like.study());
    std::vector<TrialSource> all;
    all.reserve(sources.size());
    for (const std::string& source : sources) {
      all.push_back({source, [source](const auto& take) { StudyStore::Open(source).ForEachRow(take); }});
    }
    store.AddAll(all);
  };
  RequirePlainFile(path);
  if (SizeOf(path) > 0) return add(path);
  PartialFile file(path);
  add(file.partial());
  file.Commit();
}

int MergeStudies(const std::string& out, const std::vector<std::string>& databases, bool quiet) {
  // All are looked at before anything is written.
  const StudyStore first = StudyStore::Open(databases.front());
  for (const std::string& database : databases) StudyStore::Open(database).RequireSame(first.identity());
  AddToDatabase(out, first, databases);
  const StudyStore merged = StudyStore::Open(out);
  if (!quiet) fmt::print("{}\n", Wrap(DescribeProgress(merged), 2));
  if (first.study().is_search()) return kSuccess;
  const std::vector<Trial> trials = ListTrials(first.study());
  const std::vector<Trial> missing = ListMissing(trials, merged);
  if (missing.empty()) return kSuccess;
  throw Error(fmt::format("{}: {} of {} trials are missing: {}; merge again when they are done", out,
                          missing.size(), trials.size(), ListNumbers(missing)));
}

int ShowTrial(const StudyRequest& request) {
  const StudyStore store = StudyStore::Open(request.database);
  const Study& study = store.study();
  const std::optional<TrialRow> found = store.FindRow(request.trial);
  if (!found) throw InputError(fmt::format("{}: trial {}: has no row", request.database, request.trial));
  const TrialRow& row = *found;
  Report report{.data = ToJson(study, row)};
  report.details =
      fmt::format("trial {}, seed {}: {}{}{}\n", row.trial.number, row.trial.seed, NameOf(row.result.outcome),
                  row.result.failure.empty() ? "" : ": ", row.result.failure);
  const auto add = [&](std::string_view name, const std::string& value) {
    report.details += fmt::format("  {:<36}  {}\n", name, value);
  };
  for (size_t i = 0; i < study.variations.size(); ++i)
    add(study.variations[i].key, FormatValue(study.variations[i], row.trial.parameters[i]));
  for (size_t i = 0; i < kMetrics.size(); ++i) {
    const double value = row.result.metrics[i];
    if (std::isfinite(value))
      add(kMetrics[i].name, fmt::format("{:.6g}{}", value, ShowUnit(kMetrics[i].name)));
  }
  report.last = MakeReplayCommand(study, row.trial) + "\n";
  return ReportOutput({.json_file = request.json_file}).Write(report);
}

int WriteReport(const StudyRequest& request) {
  RequirePageName(request.out);
  const StudySummary summary = SummariseStudy(StudyStore::Open(request.database));
  OutputFile(request.json_file).Write(summary.json);
  if (request.json_file.empty() || !request.out.empty())
    OutputFile(request.out.empty() ? request.database + ".html" : request.out).Write(MakeStudyPage(summary));
  return kSuccess;
}

int WriteCsv(const StudyRequest& request) {
  const StudyStore store = StudyStore::Open(request.database);
  OutputFile file(request.out.empty() ? request.database + ".csv" : request.out);
  WriteStudyCsv(store, [&](std::string_view text) { file.Append(std::string(text)); });
  file.Finish();
  return kSuccess;
}

/// Adds those commands that read a study's database: report, show, export.
void AddReadCommands(CLI::App* study, const std::shared_ptr<StudyRequest>& request) {
  const auto add = [&](const std::string& name, const std::string& help,
                       const std::array<const char*, 2>& examples) {
    CLI::App* const command = AddCommand(study, name, help, examples);
    AddOption(command, "DB", &request->database, "The study's database")->required();
    return command;
  };
  CLI::App* const report =
      add("report", "Write an HTML page of a study's results",
          {"dexcheck study report gains.sqlite", "dexcheck study report gains.sqlite --page gains.html"});
  AddOption(report, "--page FILE.html", &request->out, "The page (default: DB.html); - for standard output");
  AddJsonOption(report, "the same data", &request->json_file);
  SetAction(report, [=] { return WriteReport(*request); });

  CLI::App* const show =
      add("show", "Print one trial and the command that repeats it",
          {"dexcheck study show gains.sqlite 3", "dexcheck study show gains.sqlite 3 --json trial.json"});
  AddOption(show, "TRIAL", &request->trial, "Number of the trial")->required();
  AddJsonOption(show, "the trial", &request->json_file);
  SetAction(show, [=] { return ShowTrial(*request); });

  CLI::App* const csv =
      add("export", "Write all trials as CSV",
          {"dexcheck study export gains.sqlite", "dexcheck study export gains.sqlite --out gains.csv"});
  AddOption(csv, "--out FILE.csv", &request->out, "The file (DB.csv by default); - for standard output");
  SetAction(csv, [=] { return WriteCsv(*request); });
}

}  // namespace

void AddStudyCommand(CLI::App* app) {
  CLI::App* study =
      AddCommand(app, "study", "Vary a scenario's gains, models or plant over many runs",
                 {"dexcheck study run gains --db gains.sqlite", "dexcheck study report gains.sqlite"});
  study->require_subcommand(1);
  const auto request = std::make_shared<StudyRequest>();
  const auto whole = WholeNumber(1, 1000000);
  const auto add_quiet = [&](CLI::App* command) {
    command->add_flag("--quiet", request->quiet, "Print nothing but errors");
  };

  CLI::App* const run = AddCommand(study, "run", "Make the trials that are missing in the database",
                                   {"dexcheck study run gains --db gains.sqlite",
                                    "dexcheck study run my_study.toml --db part.sqlite --shard 1/4"});
  AddOption(run, "STUDY", &request->study, "Name of a shipped study, or a TOML file")->required();
  AddOption(run, "--db FILE.sqlite", &request->database, "Database (SQLite), made if missing")->required();
  AddControllerOptions(run, &request->controller);
  AddJobsOption(run, "Trials", &request->jobs);
  AddOption(run, "--shard I/N", &request->shard, "Only the I-th of N parts of the study");
  run->add_flag("--retry-failed", request->retry_failed, "Make trials again that crashed or timed out");
  add_quiet(run);
  SetAction(run, [=] { return RunStudy(*request); });

  CLI::App* const merge = AddCommand(study, "merge", "Put the databases of one study together",
                                     {"dexcheck study merge all.sqlite part1.sqlite part2.sqlite",
                                      "dexcheck study merge all.sqlite part1.sqlite --quiet"});
  AddOption(merge, "OUT", &request->database, "Database that gets all trials")->required();
  AddOption(merge, "DB", &request->databases, "Databases of the same study")->required();
  add_quiet(merge);
  SetAction(merge, [=] { return MergeStudies(request->database, request->databases, request->quiet); });

  AddReadCommands(study, request);

  CLI::App* const slurm = AddCommand(study, "slurm", "Print an array job for Slurm that runs the study",
                                     {"dexcheck study slurm gains --tasks 16",
                                      "dexcheck study slurm my_study.toml --tasks 16 --time 01:00:00"});
  AddOption(slurm, "STUDY", &request->study, "Name of a shipped study, or a TOML file")->required();
  const auto job = std::make_shared<SlurmJob>();
  AddControllerOptions(slurm, &request->controller);
  AddOption(slurm, "--tasks N", &job->tasks, "Parts, each with its own database")->required()->check(whole);
  AddOption(slurm, "--array-size N", &job->array_size,
            "Largest number of elements (1000, Slurm's default); each may make several parts")
      ->check(whole);
  AddOption(slurm, "--cpus N", &job->cpus, "Processors of an element (1)")->check(whole);
  AddOption(slurm, "--throttle N", &job->throttle, "Elements that run at a time")->check(whole);
  AddOption(slurm, "--time TIME", &job->time,
            "Time limit of an element: MIN, MIN:SEC, HOURS:MIN:SEC or DAYS-HOURS[:MIN[:SEC]]")
      ->check(SlurmValue("\\d{1,9}(-\\d{1,9})?(:\\d{1,9}){0,2}",
                         "must be MIN, MIN:SEC, HOURS:MIN:SEC or DAYS-HOURS[:MIN[:SEC]]"));
  AddOption(slurm, "--memory SIZE", &job->memory, "Memory of an element, as 500M or 2G")
      ->check(SlurmValue("\\d{1,9}[KMGT]?", "must be a whole number with K, M, G or T"));
  SetAction(slurm, [=] {
    StudyInputs inputs = FindStudy(request->study, request->controller);
    if (inputs.study.is_search() && job->tasks > 1)
      throw InputError("--tasks: a search needs the results of its earlier trials, so that it is one task");
    CheckTrials(&inputs);  // what study run would refuse, must not be queued
    fmt::print("{}", MakeSlurmScript(inputs, *request, *job));
    return kSuccess;
  });
}

}  // namespace dexcheck::cli
