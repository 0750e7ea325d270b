#include "harness/run/runner.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "controller/common/text.h"
#include "harness/checks/check_table.h"

namespace dexcheck {
namespace {

/// Returns the check's value in another scenario; none where that cannot be run.
std::optional<double> Repeat(const Scenario& scenario, const std::string& check,
                             const std::filesystem::path& robot, const std::filesystem::path& mjcf,
                             const std::function<bool()>& should_stop) {
  try {
    const Setup setup(scenario, robot, mjcf);
    Runner runner(setup, /*check=*/true);
    const RunResult& repeated = runner.Run([](const StepRecord&) {}, should_stop);
    if (!repeated.failure.empty() || !runner.loop().checks().Has(check)) return std::nullopt;
    return runner.loop().checks().Find(check).worst;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// Sets the cause of the run, and of failures that have none of their own.
void SetCause(Cause cause, RunResult* result) {
  for (Attribution& one : result->attribution.attributions)
    if (one.cause == result->attribution.cause) one.cause = cause;
  result->attribution.cause = cause;
  result->causes.front().faults.front().fault = NameOf(cause);
}

}  // namespace

void WeighDeclared(const Setup& setup, const ClosedLoop& loop, const std::filesystem::path& robot,
                   const std::filesystem::path& mjcf, const std::function<bool()>& should_stop,
                   RunResult* result) {
  constexpr double kLongest = 10.0;  // s
  const Scenario& scenario = setup.scenario();
  if (scenario.imperfections.declared.empty() || scenario.controller.exists()) return;
  AttributionResult& attribution = result->attribution;
  const CheckInfo* const info = FindCheck(attribution.check);
  if (!loop.is_checking() || info == nullptr || info->meaning.rank != Rank::kResidual) return;
  const CheckRecord& check = loop.checks().Find(attribution.check);
  if (!std::isfinite(check.worst)) return;
  Scenario ideal = scenario;
  ideal.duration = (check.at <= kLongest ? check.at : check.failed_at) + scenario.plant.time_step;
  if (ideal.duration > kLongest) return;
  ideal.imperfections = {};
  const std::optional<double> without = Repeat(ideal, attribution.check, robot, mjcf, should_stop);
  if (!without) return;
  const double explained = std::max(0.0, 1.0 - *without / check.worst);
  constexpr double kMost = 0.5;
  if (explained >= kMost) SetCause(Cause::kDeclared, result);
  attribution.evidence += "; without what the scenario declares (" +
                          Abbreviate(fmt::format("{}", fmt::join(scenario.imperfections.declared, ", "))) +
                          ") it is " + FormatNumber(*without, 3) + " " + check.unit + ": that explains " +
                          FormatNumber(100.0 * explained, 3) + " % of the error";
}

}  // namespace dexcheck
