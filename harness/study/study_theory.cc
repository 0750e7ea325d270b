#include "harness/study/study_theory.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dexcheck {
namespace {

constexpr int kColumns = 60;
constexpr int kRows = 40;
constexpr int kBisections = 8;

SampledLoop MakeLoop(const Scenario& scenario) {
  SampledLoop loop;
  loop.time_step = scenario.plant.time_step;
  loop.hold = std::max(1L, std::lround(scenario.plant.control_step / scenario.plant.time_step));
  return loop;
}

AxisGains GainsOf(const Scenario& scenario, int axis) {
  return {scenario.control.gains.K_p[axis], scenario.control.gains.K_v[axis]};
}

template <typename Test>
bool TestAxes(const StudyInputs& inputs, const std::vector<double>& parameters, const Test& test) {
  const Scenario scenario = MakeTrialScenario(inputs, {0, 0, parameters});
  const SampledLoop loop = MakeLoop(scenario);
  for (int axis = 0; axis < 6; ++axis) {
    if (!test(loop, GainsOf(scenario, axis))) return false;
  }
  return true;
}

/// From `from` at 0 to `to` at 1; evenly in the logarithm where that is how the key is varied.
double Interpolate(const Variation& variation, double share) {
  const bool logarithmic = variation.from > 0.0 && variation.to / variation.from > 10.0;
  if (!logarithmic) return variation.from + share * (variation.to - variation.from);
  return variation.from * std::pow(variation.to / variation.from, share);
}

}  // namespace

bool IsStableInTheory(const StudyInputs& inputs, const std::vector<double>& parameters) {
  return TestAxes(inputs, parameters, [](const SampledLoop& loop, const AxisGains& gains) {
    return CalcSpectralRadius(loop, gains) < 1.0;
  });
}

double CalcRadiusInTheory(const StudyInputs& inputs, const std::vector<double>& parameters) {
  const Scenario scenario = MakeTrialScenario(inputs, {0, 0, parameters});
  const SampledLoop loop = MakeLoop(scenario);
  double radius = 0.0;
  for (int axis = 0; axis < 6; ++axis)
    radius = std::max(radius, CalcSpectralRadius(loop, GainsOf(scenario, axis)));
  return radius;
}

bool IsDampedInTheory(const StudyInputs& inputs, const std::vector<double>& parameters) {
  return TestAxes(inputs, parameters, [](const SampledLoop& loop, const AxisGains& gains) {
    return gains.K_v >= CalcCriticalDamping(loop, gains.K_p);
  });
}

double CalcOvershootInTheory(const StudyInputs& inputs, const std::vector<double>& parameters) {
  const Scenario scenario = MakeTrialScenario(inputs, {0, 0, parameters});
  const SampledLoop loop = MakeLoop(scenario);
  const long steps = std::lround(scenario.duration / loop.time_step);
  double overshoot = 0.0;
  for (int axis = 0; axis < 6; ++axis) {
    if (scenario.start_error[axis] == 0.0) continue;
    for (const double error : CalcStepResponse(loop, GainsOf(scenario, axis), steps)) {
      if (!(std::abs(error) <= 1.0)) return std::numeric_limits<double>::infinity();
      overshoot = std::max(overshoot, -error);
    }
  }
  return overshoot;
}

std::vector<std::pair<double, double>> FindTurns(const StudyInputs& inputs,
                                                 const std::vector<double>& parameters,
                                                 const TheoryTest& holds) {
  const Variation& x = inputs.study.variations[0];
  const Variation& y = inputs.study.variations[1];
  std::vector<double> point = parameters;
  std::vector<std::pair<double, double>> turns;
  for (int i = 0; i <= kColumns; ++i) {
    point[0] = Interpolate(x, static_cast<double>(i) / kColumns);
    const auto test = [&](double share) {
      point[1] = Interpolate(y, share);
      return holds(inputs, point);
    };
    bool before = test(0.0);
    for (int j = 1; j <= kRows; ++j) {
      double low = static_cast<double>(j - 1) / kRows;
      double high = static_cast<double>(j) / kRows;
      const bool after = test(high);
      if (after == before) continue;
      for (int k = 0; k < kBisections; ++k) {
        const double middle = 0.5 * (low + high);
        (test(middle) == before ? low : high) = middle;
      }
      turns.emplace_back(point[0], Interpolate(y, high));
      before = after;
    }
  }
  return turns;
}

}  // namespace dexcheck
