#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/cli/commands.h"
#include "harness/cli/make_video.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/cli/run_report.h"
#include "harness/run/own_controller.h"
#include "harness/view/frame_source.h"
#include "harness/view/live_run.h"
#include "harness/view/viewer.h"

namespace dexcheck::cli {
namespace {

struct ViewRequest {
  std::string what;  // scenario or folder of a run
  std::string out;
  std::string save;
  Overrides overrides;
  std::uint64_t seed = 0;
  std::string size = "1120x640";
  ViewerOptions viewer;
  std::string command;  // as typed
};

/// A user who closes the window early is content, unless a check has failed by then.
ExitCode ToExitCode(const Runner& runner) {
  const RunResult& result = runner.result();
  if (result.verdict == Verdict::kPass) return kSuccess;
  if (result.verdict == Verdict::kDisagreement) return kDisagreement;
  if (!WasClosed(result)) return ReportFailure(result.failure);
  return result.attribution.cause == Cause::kNone ? kSuccess : kDisagreement;
}

/// Prints and writes what a session came to.
ExitCode Conclude(const Setup& setup, const Runner& runner, const std::filesystem::path& folder) {
  if (!folder.empty()) {
    OutputFile(folder / "summary.json")
        .Write(MakeSummary(setup, runner.loop(), runner.result()).dump(2) + "\n");
  }
  if (runner.loop().record().step > 0) {
    PrintRunReport(setup, runner.loop(), runner.result(), folder.string(), Detail::kCategories);
  }
  return ToExitCode(runner);
}

/// The part of a scenario that a session went through, once more and without a window: with the forces of the
/// mouse in the scenario from the beginning, log and verdict are those of `dexcheck run`.
ExitCode RunAgain(const ViewRequest& request, const std::vector<std::string>& overrides,
                  const std::filesystem::path& folder, long rows) {
  const ScenarioFiles files = FindScenario(request.what, overrides, request.seed);
  const Setup setup(files.scenario, files.robot, files.mjcf);
  Runner runner(setup, /*check=*/true);
  const std::filesystem::path log = folder / "log.h5";
  std::error_code ignored;
  std::filesystem::remove(log, ignored);  // of the session, in which forces came as they came
  RunRecorder recorder(log, runner.loop(), setup, RunInputs{files.robot, files.mjcf, request.command});
  RunWithProgress("recording", rows, /*quiet=*/false, &runner, &recorder);
  recorder.Close(MakeSummary(setup, runner.loop(), runner.result()).dump(2) + "\n");
  return Conclude(setup, runner, folder);
}

int ViewScenario(const ViewRequest& request) {
  std::optional<RunFolder> folder;
  const auto make = [&](const std::vector<std::string>& more) {
    std::vector<std::string> overrides = request.overrides.List();
    overrides.insert(overrides.end(), more.begin(), more.end());
    const ScenarioFiles files = FindScenario(request.what, overrides, request.seed);
    auto setup = std::make_unique<Setup>(files.scenario, files.robot, files.mjcf);
    if (!request.out.empty() && !folder) folder.emplace(request.out, files.scenario.name);
    const std::filesystem::path log = folder ? folder->path() / "log.h5" : std::filesystem::path();
    std::error_code ignored;
    if (folder) std::filesystem::remove(log, ignored);  // of the run before sliders were moved
    return std::make_unique<LiveRun>(std::move(setup), RunInputs{files.robot, files.mjcf, request.command},
                                     log, request.viewer.speed);
  };
  const auto save = [&](const LiveRun& run) -> std::string {
    const std::string name = run.setup().scenario().name + "-live";
    const std::string file = request.save.empty() ? name + ".toml" : request.save;
    try {
      OutputFile(file).Write(MakeScenarioText(run.setup().scenario(), run.ListOverrides(), name));
    } catch (const std::exception& error) {
      return std::string("not saved: ") + error.what();
    }
    const std::string seed = request.seed == 0 ? "" : fmt::format(" (needs --seed {})", request.seed);
    return "saved as " + file + seed;
  };
  // A window has threads, with which no process can go on in a copy.
  WatchController(FindScenario(request.what, request.overrides.List(), request.seed).scenario);
  CatchInterrupts();
  const std::unique_ptr<LiveRun> run = ViewLive(make, "dexcheck " + request.what, request.viewer, save);
  if (!folder || !run->was_disturbed()) {
    return Conclude(run->setup(), run->runner(), folder ? folder->path() : std::filesystem::path());
  }
  return RunAgain(request, run->ListOverrides(), folder->path(), run->rows());
}

int View(const ViewRequest& request) {
  if (Exists(std::filesystem::path(request.what) / "log.h5")) {
    if (!request.out.empty() || !request.overrides.empty() || !request.save.empty() || request.seed != 0) {
      throw UsageError("--out, --set, --controller, --seed and --save belong to a scenario; " +
                       Quote(request.what) + " is a recorded run");
    }
    const RecordedFrameSource recording(request.what);
    CatchInterrupts();
    ViewRecording(recording, "dexcheck " + request.what, request.viewer);
    return kSuccess;
  }
  return ViewScenario(request);
}

}  // namespace

void AddViewCommand(Command app, const std::string& command_line) {
  const auto request = std::make_shared<ViewRequest>();
  request->command = command_line;
  Command command = app.AddCommand("view", "Show a run while it goes on, or a recorded one, in a window");
  command.AddOption("SCENARIO|RUN_DIR", &request->what, "Scenario to run, or folder of a recorded run")
      .Required()
      .TypeName("");
  command.AddOption("--out DIR", &request->out,
                    "Folder for log and summary, made by the run (none by default)");
  AddOverrideOptions(command, &request->overrides);
  AddSeedOption(command, &request->seed);
  command.AddOption("--save FILE.toml", &request->save,
                    "Where S saves the run as a scenario (SCENARIO-live.toml by default)");
  command
      .AddOption("--speed FACTOR", &request->viewer.speed, "Simulated time against real time (1 by default)")
      .Check(PositiveNumber());
  command.AddFlag("--paused", &request->viewer.paused, "Begin paused, after the first step");
  command.AddOption("--size WxH", &request->size, "Size of the picture in pixels").ShowDefault();
  command.SetAction([=] {
    ReadSize(request->size, &request->viewer.width, &request->viewer.height);
    return View(*request);
  });
}

}  // namespace dexcheck::cli
