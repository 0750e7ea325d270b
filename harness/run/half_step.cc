#include "harness/run/half_step.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "controller/common/text.h"
#include "harness/checks/check_table.h"

namespace dexcheck {
namespace {

constexpr double kLongest = 10.0;  // s
constexpr double kFirstOrder =
    0.65;  // an error of the first order in the step, and a quarter of it for others

/// Up to when, and what the check was there.
struct Interval {
  double duration = 0.0;
  double value = 0.0;
};

Interval FindInterval(const CheckRecord& check, double time_step) {
  if (check.at <= kLongest) return {check.at + time_step, check.worst};
  return {check.failed_at + time_step, check.bound};
}

/// What the check comes to in another scenario up to that time; none where it cannot be run.
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
    return std::nullopt;  // some time of the scenario is no whole number of half steps
  }
}

/// The run's cause is this one, and so is that of failures that have none of their own.
void SetCause(Cause cause, RunResult* result) {
  for (Attribution& one : result->attribution.attributions)
    if (one.cause == result->attribution.cause) one.cause = cause;
  result->attribution.cause = cause;
  result->causes.front().faults.front().fault = NameOf(cause);
}

/// How much of the error comes of what the scenario declares: without it the same run leaves the rest.
void WeighDeclared(const Scenario& scenario, const CheckRecord& check, double without, RunResult* result) {
  std::string keys;
  for (const std::string& key : scenario.imperfections.declared) keys += (keys.empty() ? "" : ", ") + key;
  const double explained = std::max(0.0, 1.0 - without / check.worst);
  constexpr double kMost = 0.5;
  if (explained >= kMost) SetCause(Cause::kDeclared, result);
  result->attribution.evidence += "; without what the scenario declares (" + Abbreviate(keys) + ") it is " +
                                  FormatNumber(without, 3) + " " + check.unit + ": that explains " +
                                  FormatNumber(100.0 * explained, 3) + " % of the error";
}

}  // namespace

void LookForIntegrator(const Setup& setup, const ClosedLoop& loop, const std::filesystem::path& robot,
                       const std::filesystem::path& mjcf, const std::function<bool()>& should_stop,
                       RunResult* result) {
  if (setup.scenario().controller.exists()) return;  // its own gains may be those of one step
  AttributionResult& attribution = result->attribution;
  const CheckInfo* const info = FindCheck(attribution.check);
  if (!loop.is_checking() || info == nullptr || info->meaning.rank != Rank::kResidual) return;
  const CheckRecord& check = loop.checks().Find(attribution.check);
  if (!std::isfinite(check.worst)) return;
  Scenario half = setup.scenario();
  const double time_step = half.plant.time_step;
  const Interval interval = FindInterval(check, time_step);
  if (interval.duration > kLongest) return;
  if (!half.imperfections.declared.empty()) {
    half.duration = interval.duration;
    half.imperfections = {};
    if (const auto without = Repeat(half, attribution.check, robot, mjcf, should_stop))
      WeighDeclared(setup.scenario(), check, *without, result);
    return;  // noise and encoders that are declared are other ones at another step
  }
  half.duration = interval.duration;
  if (half.plant.type == PlantType::kEngine)
    half.plant.contact_time_constant = FindContactTimeConstant(half.plant);
  half.plant.time_step *= 0.5;
  const std::optional<double> value = Repeat(half, attribution.check, robot, mjcf, should_stop);
  if (!value) return;
  attribution.evidence += "; at half the step " + FormatNumber(*value, 3) + " " + check.unit;
  if (*value <= kFirstOrder * interval.value) SetCause(Cause::kIntegrator, result);
}

}  // namespace dexcheck
