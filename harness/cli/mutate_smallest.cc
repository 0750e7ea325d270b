#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "controller/common/errors.h"
#include "harness/base/interrupts.h"
#include "harness/cli/command_line.h"
#include "harness/cli/json_matrix.h"
#include "harness/cli/mutate_run.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/cli/terminal.h"
#include "harness/run/detectability.h"

namespace dexcheck::cli {
namespace {

constexpr int kStates = 24;
constexpr double kGood = 1e-3;  // an error that should be found

/// What the checks of one category find of the numbers.
struct Category {
  const char* name;
  double (*smallest)(const Detectability&);
  std::vector<std::string> checks;
};

const std::vector<Category>& ListCategories() {
  static const std::vector<Category> categories = {
      {"inverse dynamics",
       [](const Detectability& number) { return std::min(number.robot, number.object); },
       {"inverse_dynamics_robot", "inverse_dynamics_object"}},
      {"forward dynamics",
       [](const Detectability& number) { return number.prediction; },
       {"reduced_acceleration", "contact_force"}},
      {"law", [](const Detectability& number) { return number.law; }, {"law_torque"}},
  };
  return categories;
}

/// A line of the table: the numbers of one quantity, by one category of checks.
struct SmallestRow {
  int numbers = 0, shown = 0, good = 0;
  std::vector<double> errors;
};

/// What became of the median claim of a category and quantity.
struct RetriedMedian {
  std::string category, quantity, name;
  double claimed = 0.0;
  RetriedError retried;
};

/// By quantity, in the order in which they come.
std::vector<std::string> ListQuantities(const DetectabilityResult& result) {
  std::vector<std::string> quantities;
  for (const Detectability& number : result.numbers) {
    if (std::find(quantities.begin(), quantities.end(), number.quantity) == quantities.end())
      quantities.push_back(number.quantity);
  }
  return quantities;
}

/// @param quantity empty for all.
SmallestRow SumUp(const DetectabilityResult& result, const std::string& quantity, const Category& category) {
  SmallestRow row;
  for (const Detectability& number : result.numbers) {
    if (!quantity.empty() && number.quantity != quantity) continue;
    ++row.numbers;
    const double error = category.smallest(number);
    if (!std::isfinite(error)) continue;
    ++row.shown;
    row.good += error <= kGood ? 1 : 0;
    row.errors.push_back(error);
  }
  std::sort(row.errors.begin(), row.errors.end());
  return row;
}

/// The claims in the middle of each quantity, made in runs. Stops early when it is interrupted.
std::vector<RetriedMedian> RetryMedians(const DetectabilityResult& result, const ScenarioFiles& files,
                                        bool quiet) {
  const std::vector<std::string> quantities = ListQuantities(result);
  std::vector<RetriedMedian> medians;
  if (result.numbers.empty()) return medians;
  ProgressBar bar("trying again", static_cast<long>(ListCategories().size() * quantities.size()), quiet);
  for (const Category& category : ListCategories()) {
    // Without an error none may fail.
    const Parameter& any = result.numbers.front().parameter;
    if (RetryError(files.scenario, files.robot, files.mjcf, any, 0.0, category.checks, IsInterrupted).found >
        0) {
      throw InputError(files.scenario.source + ": must pass with seeds 1 to " + std::to_string(kRetrySeeds) +
                       " before faults are made in it, fails by " + category.name);
    }
    for (const std::string& quantity : quantities) {
      bar.Update(static_cast<long>(medians.size()));
      const SmallestRow row = SumUp(result, quantity, category);
      if (row.errors.empty()) continue;
      const double claimed = row.errors[row.errors.size() / 2];
      const auto number =
          std::find_if(result.numbers.begin(), result.numbers.end(), [&](const Detectability& one) {
            return one.quantity == quantity && category.smallest(one) == claimed;
          });
      const RetriedError retried = RetryError(files.scenario, files.robot, files.mjcf, number->parameter,
                                              claimed, category.checks, IsInterrupted);
      if (IsInterrupted()) return medians;
      medians.push_back({category.name, quantity, number->name, claimed, retried});
    }
  }
  bar.Finish();
  return medians;
}

Json ErrorToJson(double error) { return std::isfinite(error) ? Json(error) : Json(nullptr); }

std::string ToText(const MutateRunRequest& request, const DetectabilityResult& result,
                   const std::vector<RetriedMedian>& medians, bool complete) {
  Json json = {{"scenario", request.scenario},
               {"overrides", request.overrides.List()},
               {"states", kStates},
               {"complete", complete},
               {"rank", result.rank},
               {"largest_singular_value", result.largest_singular_value},
               {"smallest_singular_value", result.smallest_singular_value}};
  json["numbers"] = Json::array();
  for (const Detectability& number : result.numbers) {
    json["numbers"].push_back({{"name", number.name},
                               {"quantity", number.quantity},
                               {"inverse_dynamics_robot", ErrorToJson(number.robot)},
                               {"inverse_dynamics_object", ErrorToJson(number.object)},
                               {"forward_dynamics", ErrorToJson(number.prediction)},
                               {"law", ErrorToJson(number.law)}});
  }
  json["retried"] = Json::array();
  for (const RetriedMedian& median : medians) {
    json["retried"].push_back({{"category", median.category},
                               {"quantity", median.quantity},
                               {"name", median.name},
                               {"claimed", median.claimed},
                               {"error", median.retried.error},
                               {"found", median.retried.found},
                               {"runs", median.retried.runs}});
  }
  return json.dump(2) + "\n";
}

void Print(const DetectabilityResult& result, const std::vector<RetriedMedian>& medians) {
  std::vector<std::string> quantities = ListQuantities(result);
  quantities.emplace_back();  // all
  for (const Category& category : ListCategories()) {
    fmt::print(
        "smallest relative error that {} alone find, to first "
        "order\n\n{:<24}{:>8}{:>7}{:>10}{:>10}{:>10}{:>10}\n",
        category.name, "quantity", "numbers", "shown", "to 0.1 %", "best", "median", "worst");
    for (const std::string& quantity : quantities) {
      const SmallestRow row = SumUp(result, quantity, category);
      fmt::print("{:<24}{:>8}{:>7}{:>10}", quantity.empty() ? "all" : quantity, row.numbers, row.shown,
                 row.good);
      if (!row.errors.empty() && !quantity.empty()) {
        fmt::print("{:>10.1e}{:>10.1e}{:>10.1e}", row.errors.front(), row.errors[row.errors.size() / 2],
                   row.errors.back());
      }
      fmt::print("\n");
    }
    fmt::print("\n");
  }
  fmt::print("the medians, made in runs with {} seeds\n\n{:<18}{:<24}{:>10}{:>10}{:>12}\n", kRetrySeeds,
             "category", "quantity", "claimed", "made", "found");
  for (const RetriedMedian& median : medians) {
    fmt::print("{:<18}{:<24}{:>10.1e}{:>10.1e}{:>7} of {}\n", median.category, median.quantity,
               median.claimed, median.retried.error, median.retried.found, median.retried.runs);
  }
  fmt::print(
      "\n{} combinations of numbers show in the inverse dynamics; singular values from {:.2e} to {:.2e}.\n",
      result.rank, result.smallest_singular_value, result.largest_singular_value);
}

}  // namespace

int PrintSmallestErrors(const MutateRunRequest& request) {
  const ScenarioFiles files = FindScenario(request.scenario, request.overrides.List(), /*seed=*/0);
  const Setup setup(files.scenario, files.robot, files.mjcf);
  CatchInterrupts();
  std::optional<OutputFile> json;
  if (!request.json_file.empty()) json.emplace(request.json_file);
  std::optional<ProgressBar> bar;
  size_t total = 0;
  const DetectabilityResult result = FindDetectability(setup, kStates, [&](size_t done, size_t all) {
    if (!bar) bar.emplace("changing", static_cast<long>(all), request.quiet || request.json_file == "-");
    bar->Update(static_cast<long>(done));
    total = all;
    return !IsInterrupted();
  });
  if (bar) bar->Finish();
  std::vector<RetriedMedian> medians;
  if (!IsInterrupted()) medians = RetryMedians(result, files, request.quiet || request.json_file == "-");
  const bool complete = !IsInterrupted() && total > 0;
  if (json) json->Write(ToText(request, result, medians, complete));
  if (request.json_file != "-") Print(result, medians);
  if (!complete) fmt::print("INTERRUPTED after {} of {} numbers.\n", result.numbers.size(), total);
  return complete ? kSuccess : ReportFailure("interrupted");
}

}  // namespace dexcheck::cli
