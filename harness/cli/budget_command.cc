#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "harness/base/interrupts.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/cli/run_folder.h"
#include "harness/study/study_findings.h"

namespace dexcheck::cli {
namespace {

struct BudgetRequest : Outputs {
  std::string scenario;
  Overrides overrides;
  std::uint64_t seed = 0;
  std::uint64_t jobs = 0;
};

/// Returns a prediction or an error in two digits; "-" where a law is not known, so that there is none.
std::string Show(double value) { return std::isfinite(value) ? fmt::format("{:.2e}", value) : "-"; }

Report MakeReport(const ErrorBudget& budget) {
  Report report{.details = fmt::format("{}: RMS and largest {}, {}\n\n", budget.scenario,
                                       budget.of_joints ? "error of a joint" : "position error of the object",
                                       budget.unit),
                .data = ToJson(budget),
                .page = [&] { return MakeBudgetPage(budget); }};
  std::vector<TableRow> rows = {{{"source", "alone", "largest", budget.of_joints ? "predicted" : "by (57)",
                                  "without it", "interaction"}}};
  for (const BudgetEntry& e : budget.entries) {
    if (!e.failure.empty()) {
      rows.push_back({{e.name}, e.failure});
      continue;
    }
    rows.push_back({{e.name, Show(e.alone.rms), Show(e.alone.max), Show(e.predicted.rms), Show(e.without.rms),
                     fmt::format("{:.0f} %{}", 100.0 * e.interaction, e.interacts() ? "!" : " ")}});
  }
  rows.push_back({{"none of them", Show(budget.ideal.rms), Show(budget.ideal.max)}});
  // Errors up to where a run ended early are none of the motion's.
  if (budget.is_complete()) {
    report.last =
        fmt::format("{} sources: their errors add up to {:.2e} {}, all together make {:.2e} {}.\n",
                    budget.entries.size(), budget.sum.rms, budget.unit, budget.all.rms, budget.unit);
    rows.push_back(
        {{"sum of the above", Show(budget.sum.rms), Show(budget.sum.max), Show(budget.predicted.rms)}});
    rows.push_back({{"all together", Show(budget.all.rms), Show(budget.all.max)}});
  } else {
    const std::string why = budget.failure.empty() ? "a run ended early" : budget.failure;
    report.last = "INCOMPLETE: " + why + "\n";
    report.failure = "incomplete: " + why;
  }
  report.AddTable("<>>>>>", rows);
  report.details += "\n";
  return report;
}

int Run(const BudgetRequest& request) {
  const ScenarioFiles files = FindScenario(request.scenario, request.overrides.List(), request.seed);
  CatchInterrupts();
  ReportOutput outputs(request);
  std::unique_ptr<ProgressBar> bar;
  const auto progress = [&](long done, long total) {
    if (!bar) bar = std::make_unique<ProgressBar>("running", total, request.quiet);
    return bar->GoOn(done);
  };
  const ErrorBudget budget =
      CalcErrorBudget(files.scenario, files.robot, files.mjcf, CountJobs(request.jobs), progress);
  if (bar) bar->Finish();
  return outputs.Write(MakeReport(budget));
}

}  // namespace

void AddBudgetCommand(CLI::App* app) {
  const auto [command, request] = AddRequest<BudgetRequest>(
      app, "budget", "Show which declared imperfection costs the accuracy: each alone, all but one, all",
      {"dexcheck budget curve-real", "dexcheck budget motion.toml --set duration=2"});
  AddOption(command, "SCENARIO", &request->scenario, "A shipped scenario, or a TOML file")->required();
  AddOverrideOptions(command, &request->overrides);
  AddSeedOption(command, &request->seed, "Seed of all that is random");
  AddOption(command, "--page FILE.html", &request->page_file, "Write table and bar chart as a page");
  AddJobsOption(command, "Runs", &request->jobs);
  AddJsonOption(command, "the budget", &request->json_file);
  command->add_flag("--quiet", request->quiet, "Print the last line only");
}

}  // namespace dexcheck::cli
