#include "harness/run/half_step.h"

#include <algorithm>
#include <cmath>

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

}  // namespace

void LookForIntegrator(const Setup& setup, const ClosedLoop& loop, const std::filesystem::path& robot,
                       const std::filesystem::path& mjcf, const std::function<bool()>& should_stop,
                       RunResult* result) {
  if (setup.scenario().controller.exists()) return;  // its own gains may be those of one step
  AttributionResult& attribution = result->attribution;
  const CheckInfo* const info = FindCheck(attribution.check);
  // Noise and encoders that are declared are other ones at another step.
  if (attribution.cause == Cause::kDeclared) return;
  if (!loop.is_checking() || info == nullptr || info->meaning.rank != Rank::kResidual) return;
  const CheckRecord& check = loop.checks().Find(attribution.check);
  if (!std::isfinite(check.worst)) return;
  Scenario half = setup.scenario();
  const double time_step = half.plant.time_step;
  const Interval interval = FindInterval(check, time_step);
  if (interval.duration > kLongest) return;
  half.duration = interval.duration;
  if (half.plant.type == PlantType::kEngine)
    half.plant.contact_time_constant = FindContactTimeConstant(half.plant);
  half.plant.time_step *= 0.5;
  try {
    const Setup half_setup(half, robot, mjcf);
    Runner runner(half_setup, /*check=*/true);
    const RunResult& repeated = runner.Run([](const StepRecord&) {}, should_stop);
    if (!repeated.failure.empty()) return;
    const double value = runner.loop().checks().Find(attribution.check).worst;
    attribution.evidence += "; at half the step " + FormatNumber(value, 3) + " " + check.unit;
    if (!(value <= kFirstOrder * interval.value)) return;
    // Those that have no cause of their own have the run's.
    for (Attribution& one : attribution.attributions)
      if (one.cause == attribution.cause) one.cause = Cause::kIntegrator;
    attribution.cause = Cause::kIntegrator;
    result->causes.front().faults.front().fault = NameOf(Cause::kIntegrator);
  } catch (const InputError&) {
    // Some time of the scenario is no whole number of half steps.
  }
}

}  // namespace dexcheck
