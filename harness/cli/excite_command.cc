#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "harness/base/console.h"
#include "harness/base/interrupts.h"
#include "harness/cli/commands.h"
#include "harness/cli/excite_model.h"
#include "harness/cli/json_matrix.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/cli/terminal.h"
#include "harness/run/excitation.h"
#include "harness/study/exciting_motion.h"

namespace dexcheck::cli {
namespace {

// A motion of a model alone takes some milliseconds, a run a second.
constexpr int kMotionsPerRun = 10;

struct ExciteRequest : ScenarioRequest {
  ExcitingMotionOptions options;
  MotionRequest of_model;
};

std::string Head(const ExcitingMotion& motion) {
  return fmt::format("{} numbers of the motion, {} runs", motion.keys.size(), motion.runs);
}

void Print(const Scenario& scenario, const ExcitingMotion& motion) {
  std::vector<TableRow> rows = {{{"regressor of (48) along the run", "given", "found"}}};
  const auto both = [&](const std::string& what, const char* format, const auto& calc) {
    rows.push_back({{what, fmt::format(fmt::runtime(format), calc(motion.given)),
                     fmt::format(fmt::runtime(format), calc(motion.found))}});
  };
  both("largest singular value", "{:.3e}", [](const JudgedMotion& m) { return m.singular_values[0]; });
  both(fmt::format("smallest of {} that show", motion.rank), "{:.3e}",
       [](const JudgedMotion& m) { return m.smallest; });
  both("condition number of these", "{:.3e}", [](const JudgedMotion& m) { return m.condition(); });
  both(fmt::format("combinations above the floor of {:.0e}", motion.floor), "{}",
       [&](const JudgedMotion& m) { return CountAbove(m.singular_values, motion.floor); });
  fmt::print("{}: {}\n\n{}", scenario.name, Head(motion), FormatTable("<>>", rows));
  fmt::print("nearest to what it may take: {}\n\n", motion.found.nearest);
  for (const std::string& setting : motion.overrides) fmt::print("--set {}\n", QuoteForShell(setting));
}

std::string ToText(const Scenario& scenario, const ExcitingMotion& motion, bool complete) {
  const auto judged = [&](const JudgedMotion& m) {
    return Json{{"smallest_singular_value", m.smallest},
                {"condition_number", m.condition()},
                {"above_floor", CountAbove(m.singular_values, motion.floor)},
                {"singular_values", ToList(m.singular_values)}};
  };
  Json json = {{"scenario", scenario.name},     {"complete", complete},
               {"runs", motion.runs},           {"floor", motion.floor},
               {"rank", motion.rank},           {"given", judged(motion.given)},
               {"found", judged(motion.found)}, {"overrides", motion.overrides}};
  return json.dump(2) + "\n";
}

int Run(const ExciteRequest& request) {
  if (!request.of_model.model.empty()) {
    if (!request.scenario.empty()) throw UsageError("excite: SCENARIO and --model exclude each other");
    MotionRequest of_model = request.of_model;
    of_model.options.evaluations = request.options.runs * kMotionsPerRun;
    of_model.json_file = request.json_file;
    of_model.quiet = request.quiet;
    return DesignMotionOfModel(of_model);
  }
  if (request.scenario.empty()) throw UsageError("excite: SCENARIO or --model is required");
  const ScenarioFiles files = FindScenario(request.scenario, request.overrides.List(), /*seed=*/0);
  CatchInterrupts();
  ResultFile json(request.json_file);
  ProgressBar bar("running", request.options.runs, request.quiet);
  const ExcitingMotion motion =
      FindExcitingMotion(files.scenario, files.robot, files.mjcf, request.options, [&](int runs) {
        bar.Update(runs);
        return !IsInterrupted();
      });
  bar.Finish();
  const bool complete = !IsInterrupted();
  json.Write([&] { return ToText(files.scenario, motion, complete); });
  if (!json.TakesStdout()) {
    if (!request.quiet) Print(files.scenario, motion);
    fmt::print("{}{}: smallest singular value {:.2e}, {:.3g} times the given motion's.\n",
               request.quiet ? "" : "\n", complete ? "FOUND" : "INTERRUPTED, so far", motion.found.smallest,
               motion.found.smallest / motion.given.smallest);
  }
  return complete ? kSuccess : ReportFailure("interrupted");
}

}  // namespace

void AddExciteCommand(Command app) {
  const auto request = std::make_shared<ExciteRequest>();
  Command command = app.AddCommand("excite",
                                   "Change a scenario's oscillations so that the model's numbers show best "
                                   "within all limits; or, with --model, make a motion to record");
  AddScenarioOptions(command, request.get()).Required(false);
  command
      .AddOption("--runs N", &request->options.runs,
                 "How many runs to make; of a model, ten motions for each")
      .Check(WholeNumber(1, 100000))
      .ShowDefault();
  command
      .AddOption("--fraction X", &request->options.fraction,
                 "What each check may take of its bound, or as much as before where that is more")
      .Check(PositiveNumber())
      .ShowDefault();
  AddResultOptions(command, "the results", request.get());
  AddMotionOptions(command, &request->of_model);
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
