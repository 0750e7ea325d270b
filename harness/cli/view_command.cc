#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/interrupts.h"
#include "harness/cli/commands.h"
#include "harness/cli/make_video.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/cli/run_report.h"
#include "harness/view/recording.h"
#include "harness/view/save_scenario.h"
#include "harness/view/viewer.h"

namespace dexcheck::cli {
namespace {

struct Request {
  std::string what;  // scenario or folder of a run
  std::string out;
  std::string save;
  std::vector<std::string> overrides;
  std::uint64_t seed = 0;
  std::string size = "1120x640";
  ViewerOptions viewer;
  std::string command;  // as typed
};

/// A user who closes the window early is content, unless a check has failed by then.
ExitCode ToExitCode(const LiveRun& run) {
  const RunResult& result = run.runner().result();
  if (result.verdict == Verdict::kPass) return kSuccess;
  if (result.verdict == Verdict::kDisagreement) return kDisagreement;
  if (!result.interrupted) return kFailure;
  const CrossCheck& checks = run.runner().loop().checks();
  for (const std::span<const CheckRecord> records : {checks.model_checks(), checks.motion_checks()}) {
    for (const CheckRecord& check : records) {
      if (check.applies && check.failed) return kDisagreement;
    }
  }
  return kSuccess;
}

int ViewScenario(const Request& request) {
  std::optional<RunFolder> folder;
  const auto make = [&](const std::vector<std::string>& more) {
    std::vector<std::string> overrides = request.overrides;
    overrides.insert(overrides.end(), more.begin(), more.end());
    const ScenarioFiles files = FindScenario(request.what, overrides, request.seed);
    auto setup = std::make_unique<Setup>(files.scenario, files.robot, files.mjcf);
    if (!request.out.empty() && !folder) folder.emplace(request.out, files.scenario.name);
    const std::filesystem::path log = folder ? folder->path() / "log.h5" : std::filesystem::path();
    std::error_code ignored;
    if (folder) std::filesystem::remove(log, ignored);  // of the run before sliders were moved
    return std::make_unique<LiveRun>(
        std::move(setup), RunInputs{files.robot, files.mjcf, request.command, ""}, log, request.viewer.speed);
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
  CatchInterrupts();
  const std::unique_ptr<LiveRun> run = ViewLive(make, "dexcheck " + request.what, request.viewer, save);
  const ExitCode code = ToExitCode(*run);
  if (folder) {
    OutputFile(folder->path() / "summary.json")
        .Write(MakeSummary(run->setup(), run->runner().loop(), run->runner().result()).dump(2) + "\n");
  }
  if (run->rows() > 0) {
    PrintRunReport(run->setup(), run->runner().loop(), run->runner().result(),
                   folder ? folder->path().string() : "", Detail::kQuestions);
  }
  return code;
}

int View(const Request& request) {
  if (std::filesystem::exists(std::filesystem::path(request.what) / "log.h5")) {
    if (!request.out.empty() || !request.overrides.empty() || !request.save.empty() || request.seed != 0) {
      throw UsageError("--out, --set, --seed and --save belong to a scenario; " + Quote(request.what) +
                       " is a recorded run");
    }
    const Recording recording(request.what);
    CatchInterrupts();
    ViewRecording(recording, "dexcheck " + request.what, request.viewer);
    return kSuccess;
  }
  return ViewScenario(request);
}

}  // namespace

void AddViewCommand(Command app, const std::string& command_line) {
  const auto request = std::make_shared<Request>();
  request->command = command_line;
  Command command = app.AddCommand("view", "Show a run while it goes on, or a recorded one, in a window");
  command.AddOption("SCENARIO|RUN_DIR", &request->what, "Scenario to run, or folder of a recorded run")
      .Required()
      .TypeName("");
  command.AddOption("--out", &request->out, "Folder for log and summary, made by the run (none by default)")
      .TypeName("DIR");
  command
      .AddOption("--set", &request->overrides,
                 "Set a key of the scenario, or with model. before it one of the parameter file")
      .TypeName("KEY=VALUE")
      .Repeatable();
  command.AddOption("--seed", &request->seed, "Vary posture and grasp at random; 0 does not")
      .TypeName("N")
      .Check(WholeNumber(0, std::numeric_limits<std::uint64_t>::max()));
  command
      .AddOption("--save", &request->save,
                 "Where S saves the run as a scenario (SCENARIO-live.toml by default)")
      .TypeName("FILE.toml");
  command.AddOption("--speed", &request->viewer.speed, "Simulated time against real time (1 by default)")
      .TypeName("FACTOR")
      .Check(PositiveNumber());
  command.AddFlag("--paused", &request->viewer.paused, "Begin paused, after the first step");
  command.AddOption("--size", &request->size, "Of the picture, in pixels").TypeName("WxH").ShowDefault();
  command.SetAction([=] {
    ReadSize(request->size, &request->viewer.width, &request->viewer.height);
    return View(*request);
  });
}

}  // namespace dexcheck::cli
