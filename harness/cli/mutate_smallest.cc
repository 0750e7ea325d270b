#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "harness/base/interrupts.h"
#include "harness/cli/command_line.h"
#include "harness/cli/json_matrix.h"
#include "harness/cli/mutate_run.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/run/detectability.h"

namespace dexcheck::cli {
namespace {

constexpr int kStates = 24;

std::string ToText(const MutateRunRequest& request, const std::vector<Detectability>& all, bool complete) {
  Json json = {{"scenario", request.scenario},
               {"overrides", request.overrides.List()},
               {"states", kStates},
               {"complete", complete},
               {"numbers", Json::array()}};
  for (const Detectability& one : all) {
    json["numbers"].push_back({{"fault", one.fault},
                               {"place", one.place},
                               {"component", one.component},
                               {"unit", one.unit},
                               {"found", one.found},
                               {"named", one.named},
                               {"rival", one.rival}});
  }
  return json.dump(2) + "\n";  // null for infinite
}

/// Sizes of one fault, sorted, those that are infinite last.
std::vector<double> Sort(const std::vector<Detectability>& all, const Detectability& like,
                         double Detectability::*size) {
  std::vector<double> sizes;
  for (const Detectability& one : all)
    if (one.fault == like.fault && one.unit == like.unit) sizes.push_back(one.*size);
  std::sort(sizes.begin(), sizes.end());
  return sizes;
}

void Print(const std::vector<Detectability>& all) {
  fmt::print("smallest faults that the balances find and name, to first order\n\n{:<34}{:>8}{:>7}{:>7}",
             "fault", "numbers", "found", "named");
  fmt::print("{:>20}{:>20}\n", "found: best, median", "named: best, median");
  std::vector<std::string> done;
  for (const Detectability& one : all) {
    const std::string name = one.fault + ", " + (one.unit.empty() ? "1" : one.unit);
    if (std::find(done.begin(), done.end(), name) != done.end()) continue;
    done.push_back(name);
    std::string counts, medians;
    for (double Detectability::*size : {&Detectability::found, &Detectability::named}) {
      const std::vector<double> sizes = Sort(all, one, size);
      const auto shown = std::count_if(sizes.begin(), sizes.end(), [](double s) { return std::isfinite(s); });
      if (size == &Detectability::found) counts = fmt::format("{:>8}", sizes.size());
      counts += fmt::format("{:>7}", shown);
      medians += fmt::format("{:>10.1e}{:>10.1e}", sizes.front(), sizes[sizes.size() / 2]);
    }
    fmt::print("{:<34}{}{}\n", name, counts, medians);
  }
}

}  // namespace

int PrintSmallestErrors(const MutateRunRequest& request) {
  const ScenarioFiles files = FindScenario(request.scenario, request.overrides.List(), /*seed=*/0);
  const Setup setup(files.scenario, files.robot, files.mjcf);
  CatchInterrupts();
  std::optional<OutputFile> json;
  if (!request.json_file.empty()) json.emplace(request.json_file);
  const std::vector<Detectability> all = FindDetectability(setup, kStates, IsInterrupted);
  const bool complete = !IsInterrupted();
  if (json) json->Write(ToText(request, all, complete));
  if (request.json_file != "-") Print(all);
  return complete ? kSuccess : ReportFailure("interrupted");
}

}  // namespace dexcheck::cli
