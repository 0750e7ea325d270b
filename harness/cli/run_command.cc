#include <fmt/format.h>

#include <array>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/cli/run_folder.h"
#include "harness/comparison/file_differences.h"
#include "harness/engine/machine.h"
#include "harness/report/page.h"
#include "harness/report/run_data.h"
#include "harness/run/joint_margins.h"
#include "harness/run/runner.h"

namespace dexcheck::cli {
namespace {

struct RunRequest : Outputs {
  std::string scenario;
  std::string out;
  Overrides overrides;
  ToleranceOptions judging;
  std::uint64_t seed = 0;
  bool no_check = false;
  bool no_log = false;
  bool no_report = false;
  bool video = false;
  bool all = false;  // checks are printed
  bool gains = false;
  bool list = false;
  std::string replay;
  std::string command;  // as typed
};

/// The run and its verdict stand without a video or a report: why there is none is a warning.
template <typename Make>
void TryToMake(const char* what, const Make& make) {
  try {
    make();
  } catch (const std::exception& error) {
    Warn(fmt::format("no {}: {}", what, error.what()));
  }
}

/// Draws what was requested into the run's folder, after the verdict.
void DrawRun(const RunRequest& request, const std::filesystem::path& folder, ExitCode verdict) {
  const bool quiet = request.quiet || request.json_file == "-";
  if (request.video) {
    TryToMake("video", [&] { WriteRunVideo(folder, (folder / "video.mp4").string(), quiet); });
  }
  EndOnInterrupts(verdict);
  if (request.no_report || IsInterrupted()) return;
  TryToMake("report", [&] {
    const ReportFiles files = MakeReportFiles(folder);
    WriteRunReport(folder, files);
    if (!quiet) fmt::print("report: {}\n", files.page.string());
  });
}

/// Judges the two files of joints as consistency does: numbers that agree within their printed digits are
/// judged by these. @return what differs; empty where the files agree, or where the scenario changes or
/// leaves out one of them.
std::string JudgeFiles(ScenarioFiles* files) {
  Scenario& scenario = files->scenario;
  const bool is_judged = scenario.tolerance == 0.0 && scenario.joint_task() != nullptr &&
                         scenario.plant.type != PlantType::kRigid && scenario.model_overrides.empty();
  if (!is_judged) return "";
  ConsistencyOptions options;
  options.samples = 20;
  options.within_digits = true;
  const Comparison comparison = CompareFiles(files->robot, files->mjcf, {}, options);
  if (!comparison.Agrees()) return ListDifferences(comparison).front();
  scenario.tolerance = CalcTolerance(comparison.result);
  if (scenario.tolerance > 0.0)
    Warn(fmt::format("{} and {} agree within the printed digits: the model is judged to {:.0e}",
                     files->robot.filename().string(), files->mjcf.filename().string(), scenario.tolerance));
  return "";
}

int RunScenario(const RunRequest& request) {
  const bool quiet = request.quiet || request.json_file == "-";
  std::vector<std::string> overrides = request.overrides.List();
  if (const std::optional<double> tolerance = request.judging.Find()) {
    overrides.push_back("tolerance=" + FormatNumber(*tolerance));
  }
  ScenarioFiles files = FindScenario(request.scenario, overrides, request.seed);
  const std::string difference = request.no_check ? "" : JudgeFiles(&files);
  ReportOutput output(request);
  const Setup setup(files.scenario, files.robot, files.mjcf);
  CatchInterrupts();
  Runner runner(setup, !request.no_check);
  std::filesystem::path folder;  // none without a log
  if (!request.no_log) folder = MakeRunFolder(request.out, setup.scenario().name);
  std::optional<RunRecorder> recorder;
  if (!folder.empty()) {
    recorder.emplace(folder / "log.h5", runner.loop(), setup,
                     RunInputs{files.robot, files.mjcf, request.command});
  }
  RunWithProgress(setup.scenario().name, runner.loop().num_steps(), quiet, &runner,
                  recorder ? &*recorder : nullptr);
  RunResult result = runner.result();
  WeighDeclared(setup, runner.loop(), files.robot, files.mjcf, IsInterrupted, &result);
  JudgeGains(setup, runner.loop(), &result);
  if (!difference.empty() && result.verdict == Verdict::kPass) {
    result.verdict = Verdict::kDisagreement;
    result.attribution.cause = Cause::kModel;
    result.attribution.evidence = difference;
  }

  const Json summary = MakeSummary(setup, runner.loop(), result);
  const std::string text = FormatJson(summary);
  if (recorder) recorder->Close(text);
  if (!folder.empty()) OutputFile(folder / "summary.json").Write(text);
  if (!folder.empty() && !result.gain_card.empty())
    OutputFile(folder / "gain_card.toml").Write(result.gain_card);
  Report report = MakeRunReport(setup, runner.loop(), result, summary, folder.string(), request.all);
  if (result.attribution.cause == Cause::kModel && files.scenario.model_overrides.empty())
    report.answer.remarks.push_back(fmt::format("why: dexcheck diagnose {} {}",
                                                QuoteForShell(files.robot.string()),
                                                QuoteForShell(files.mjcf.string())));
  if (request.gains)
    report.last =
        "\n" + (result.gain_card.empty() ? "no margins: only a joint motion under its law has them\n"
                                         : result.gain_card);
  const ExitCode verdict = result.verdict == Verdict::kFailed ? kFailure : report.code;
  std::exception_ptr unprinted;
  try {
    output.Write(report);
    FlushOutput();
  } catch (const std::exception&) {
    unprinted = std::current_exception();  // standard output takes nothing: reported when all is done
  }
  if (!folder.empty() && !IsInterrupted()) {
    if (runner.loop().record().step > 0) {
      DrawRun(request, folder, verdict);
    } else if (request.video) {
      Warn("no video: the run ended before its first step");
    }
  }
  if (unprinted) std::rethrow_exception(unprinted);
  return verdict;
}

/// A line on standard error when the run's own controller is another file now.
void WarnOfController(const LogReader& log, const OwnControllerOptions& own) {
  const std::string hash = log.FindText("controller_hash");
  if (own.exists() && !hash.empty() && hash != HashController(own))
    Warn("note: controller " + own.run + " is not the file that made the run");
}

/// Repeats a recorded run from what its log keeps, and compares every number bit for bit.
int ReplayRun(const RunRequest& request) {
  const RecordedRun recorded(request.replay, request.overrides.controller.List());
  const std::string cut = DescribeCut(recorded.log());
  if (recorded.rows() == 0) throw InputError(request.replay + "/log.h5: nothing to compare: " + cut);
  const Setup setup(recorded.files().scenario, recorded.files().robot, recorded.files().mjcf);
  WarnOfController(recorded.log(), setup.scenario().controller);
  CatchInterrupts();
  Runner runner(setup, recorded.was_checked());
  const TemporaryFolder scratch;
  const std::filesystem::path log = scratch.path() / "log.h5";
  RunRecorder recorder(log, runner.loop(), setup,
                       RunInputs{recorded.files().robot, recorded.files().mjcf, ""});
  const long rows = RunWithProgress("replaying", recorded.rows(), request.quiet, &runner, &recorder);
  if (IsInterrupted() && rows < recorded.rows()) {
    throw Error(fmt::format("interrupted after {} of {} steps; nothing was compared", rows, recorded.rows()));
  }
  EndOnInterrupts(kFailure);
  recorder.Close("");
  const ReplayDifference difference = recorded.Compare(log);
  if (!cut.empty()) {
    fmt::print("Only {} steps are compared: {}.\n", runner.loop().num_steps(), cut);
  }
  for (const OldName& old : difference.replaced)
    fmt::print("Not compared: {}, which {} replaced.\n", old.old, old.now);
  if (difference.signal.empty()) {
    fmt::print("IDENTICAL: {} steps of {} signals, bit for bit.\n", difference.rows, difference.signals);
    return kSuccess;
  }
  const std::string machine = recorded.machine();
  const bool other_machine = machine != DescribeMachine();
  const bool expected = other_machine && !machine.empty() && difference.within_rounding;
  fmt::print("DIFFERENT{}: {} at t = {} s: {} in the log, {} now.\n", expected ? " MACHINE" : "",
             difference.signal, FormatNumber(difference.time), FormatNumber(difference.recorded),
             FormatNumber(difference.now));
  if (!other_machine) return kDisagreement;
  if (machine.empty()) {
    fmt::print("The log does not say on which machine it was written.\n");
    return kDisagreement;
  }
  fmt::print("written on:  {}\nrepeated on: {}\n{}\n", machine, DescribeMachine(),
             expected ? "All numbers agree within what rounding makes of that."
                      : "Rounding alone does not explain the difference.");
  return expected ? kSuccess : kDisagreement;
}

/// Prints the shipped scenarios, of one that cannot be read why not.
void ListScenarios() {
  const std::filesystem::path folder = FindShippedFile(kScenarios.folder);
  for (const std::string& name : kScenarios.ListNames()) {
    const std::string file = (folder / (name + ".toml")).string();
    try {
      const Scenario scenario = ParseScenario(ReadBytes(file), file, folder, {});
      fmt::print("{}\n", Wrap(fmt::format("{:<14} {}", name, scenario.description), 15));
    } catch (const InputError& error) {
      fmt::print("{:<14} unreadable: {}\n", name, error.what());
    }
  }
  fmt::print(
      "\nTo change one, copy its file with the folders that it names, or --set its keys:\n  cp {} my.toml\n",
      QuoteForShell((folder / "paper.toml").string()));
}

int Run(const RunRequest& request) {
  if (request.scenario.empty() && !request.list && request.replay.empty())
    throw UsageError("SCENARIO (or --list, or --replay) is required");
  if (request.json_file == "-" && (request.quiet || request.all))
    throw UsageError("--json without a file excludes --quiet and --all");
  if (request.list) {
    ListScenarios();
    return kSuccess;
  }
  if (!request.replay.empty()) return ReplayRun(request);
  return RunScenario(request);
}

}  // namespace

void AddRunCommand(CLI::App* app, const std::string& command_line) {
  const auto [command, request] = AddRequest<RunRequest>(
      app, "run", "Simulate a scenario, cross-checked at every step",
      {"dexcheck run paper --out my_run", "dexcheck run motion.toml --controller law.py"});
  request->command = command_line;
  CLI::Option* const scenario = AddOption(command, "SCENARIO", &request->scenario,
                                          "Name of a shipped scenario (--list), or a TOML file");
  CLI::Option* const list = command->add_flag("--list", request->list, "List the shipped scenarios");
  CLI::Option* const replay = AddOption(command, "--replay RUN_DIR", &request->replay,
                                        "Repeat a recorded run and compare every number bit for bit");
  CLI::Option* const out = AddOption(command, "--out DIR", &request->out,
                                     "Folder for the results, made by the run (runs/SCENARIO by default)");
  const auto [set, unset, controller] = AddOverrideOptions(command, &request->overrides);
  const std::array<CLI::Option*, 2> judging = AddToleranceOptions(command, &request->judging);
  CLI::Option* const seed = AddSeedOption(command, &request->seed);
  CLI::Option* const no_check =
      command->add_flag("--no-check", request->no_check, "Simulate without cross-checks");
  CLI::Option* const video =
      command->add_flag("--video", request->video, "Draw the run as a video, video.mp4");
  CLI::Option* const no_report =
      command->add_flag("--no-report", request->no_report, "Write the log and the summary only");
  CLI::Option* const junit = AddJUnitOption(command, &request->junit_file);
  CLI::Option* const no_log = command->add_flag("--no-log", request->no_log, "Write no files");
  CLI::Option* const quiet = command->add_flag("--quiet", request->quiet, "Print the verdict only");
  CLI::Option* const gains =
      command->add_flag("--gains", request->gains,
                        "Print a joint motion's gains, stability margins, and its fastest safe gains");
  CLI::Option* const all =
      command->add_flag("--all", request->all, "Print each check, not only a line for each category");
  CLI::Option* const json = AddJsonOption(command, "the summary", &request->json_file);
  controller->excludes(list);
  scenario->excludes(list)->excludes(replay);
  list->excludes(replay);
  // Options that would be ignored are refused.
  for (CLI::Option* option : judging) option->excludes(list)->excludes(replay);
  no_log->excludes(video)->excludes(out);
  all->excludes(quiet);
  for (CLI::Option* option :
       {out, set, unset, seed, no_check, video, no_report, no_log, junit, all, gains, json}) {
    option->excludes(replay)->excludes(list);
  }
}

}  // namespace dexcheck::cli
