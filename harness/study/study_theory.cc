#include "harness/study/study_theory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"
#include "harness/plant/velocity_filter.h"
#include "harness/study/search.h"
#include "harness/study/trial_monitor.h"

namespace dexcheck {
namespace {

constexpr int kColumns = 60;
constexpr int kRows = 40;
constexpr int kBisections = 8;

/// The faults of sensing and motors that all axes have alike.
SampledLoop MakeLoop(const Scenario& scenario) {
  SampledLoop loop;
  loop.time_step = scenario.plant.time_step;
  loop.hold = std::max(1L, std::lround(scenario.plant.control_step / scenario.plant.time_step));
  const SensingOptions& sensing = scenario.imperfections.sensing;
  const ActuationOptions& actuation = scenario.imperfections.actuation;
  loop.delay = actuation.delay;
  loop.latency =
      CountSteps(sensing.latency, loop.time_step) + CountSteps(sensing.object_latency, loop.time_step);
  if (sensing.object_velocity == VelocitySource::kDifferenced) {
    loop.low_pass = CalcLowPassGain(sensing.object_velocity_cutoff, loop.time_step);
  }
  if (actuation.lag.groups.empty()) loop.lag = actuation.lag.all;
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
double Interpolate(const Variation& variation, double fraction) {
  const bool logarithmic = variation.from > 0.0 && variation.to / variation.from > 10.0;
  if (!logarithmic) return variation.from + fraction * (variation.to - variation.from);
  return variation.from * std::pow(variation.to / variation.from, fraction);
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
  return TestAxes(inputs, parameters, IsDamped);
}

double CalcOvershootInTheory(const StudyInputs& inputs, const std::vector<double>& parameters) {
  const Scenario scenario = MakeTrialScenario(inputs, {0, 0, parameters});
  const SampledLoop loop = MakeLoop(scenario);
  const long steps = std::lround(scenario.duration / loop.time_step);
  double overshoot = 0.0;
  for (int axis = 0; axis < 6; ++axis) {
    if (scenario.start_error()[axis] == 0.0) continue;
    for (const double error : CalcStepResponse(loop, GainsOf(scenario, axis), steps)) {
      if (!(std::abs(error) <= 1.0)) return std::numeric_limits<double>::infinity();
      overshoot = std::max(overshoot, -error);
    }
  }
  return overshoot;
}

namespace {

/// Whether the object's position follows (57), with what MakeLoop takes into account and nothing besides.
bool FollowsErrorDynamics(const Scenario& scenario) {
  Imperfections rest = scenario.imperfections;
  rest.actuation.delay = rest.actuation.lag.all = 0.0;
  rest.actuation.saturate = false;
  rest.sensing.latency = rest.sensing.object_latency = 0.0;
  if (rest.sensing.object_velocity == VelocitySource::kDifferenced) {
    rest.sensing.object_velocity = VelocitySource::kMeasured;
    rest.sensing.object_velocity_cutoff = 0.0;
  }
  return rest.is_ideal() && scenario.control.law == ControlLaw::kComputedTorque &&
         scenario.control.contact_error == 0.0 && scenario.trajectory_task() != nullptr &&
         scenario.start_error().head<3>().norm() > 0.0;
}

}  // namespace

TrialResult PredictInTheory(const StudyInputs& inputs, const std::vector<double>& parameters) {
  TrialResult result;
  result.metrics.fill(std::numeric_limits<double>::quiet_NaN());
  const Scenario scenario = MakeTrialScenario(inputs, {0, 0, parameters});
  if (!FollowsErrorDynamics(scenario)) return result;
  const SampledLoop loop = MakeLoop(scenario);
  const auto steps = static_cast<size_t>(std::lround(scenario.duration / loop.time_step));
  const Vector3d start = scenario.start_error().head<3>();
  std::vector<Vector3d> errors(steps, Vector3d::Zero());
  for (int axis = 0; axis < 3; ++axis) {
    if (start[axis] == 0.0) continue;
    const AxisGains gains = GainsOf(scenario, axis);
    if (!(CalcSpectralRadius(loop, gains) < 1.0)) return result;
    const std::vector<double> response = CalcStepResponse(loop, gains, static_cast<long>(steps));
    for (size_t k = 0; k < steps; ++k) errors[k][axis] = start[axis] * response[k];
  }
  // As TrialMonitor does.
  double squares = 0.0, largest = 0.0, overshoot = 0.0, settled_since = 0.0;
  std::array<double, 4> quarters{};
  bool settled = false;
  for (size_t k = 0; k < steps; ++k) {
    const double size = errors[k].norm();
    squares += size * size;
    quarters[4 * k / steps] += size * size;
    largest = std::max(largest, size);
    overshoot = std::max(overshoot, -errors[k].dot(start) / start.squaredNorm());
    const bool inside = size <= kSettledFraction * start.norm();
    if (inside && !settled) settled_since = static_cast<double>(k) * loop.time_step;
    settled = inside;
  }
  result.metrics[kPositionErrorRms] = std::sqrt(squares / static_cast<double>(steps));
  result.metrics[kPositionErrorMax] = largest;
  if (settled) result.metrics[kSettlingTime] = settled_since;
  result.metrics[kOvershoot] = overshoot;
  result.metrics[kErrorGrowth] = std::sqrt(quarters[3] / quarters[0]);
  return result;
}

Judgement JudgeInTheory(const StudyInputs& inputs, const std::vector<double>& values) {
  std::vector<TrialResult> results;
  for (const std::vector<double>& draw : ListDraws(inputs.study)) {
    std::vector<double> parameters = values;
    parameters.insert(parameters.end(), draw.begin(), draw.end());
    results.push_back(PredictInTheory(inputs, parameters));
  }
  return JudgePoint(inputs.study.objectives, {}, results);
}

std::optional<double> FindLeastInTheory(const StudyInputs& inputs) {
  const Study& study = inputs.study;
  if (study.objectives.empty()) return std::nullopt;
  const auto judge = [&](const UnitPoint& point) {
    try {
      return JudgeInTheory(inputs, ValuesAt(study.keys(), point));
    } catch (const InputError&) {  // values that make no scenario
      return Judgement{{std::numeric_limits<double>::infinity()}, 1.0};
    }
  };
  constexpr long kPoints = 128;
  const int keys = static_cast<int>(study.num_keys());
  if (keys > kMaxSobolDimensions) return std::nullopt;
  UnitPoint best;
  Judgement least;
  for (const UnitPoint& point : MakeSobol(keys, kPoints)) {
    const Judgement judgement = judge(point);
    if (best.empty() || IsBetter(judgement, least)) {
      best = point;
      least = judgement;
    }
  }
  if (!least.is_feasible()) return std::nullopt;
  // From there downhill.
  Search search;
  search.method = SearchMethod::kNelderMead;
  search.step = 0.1;
  constexpr int kSteps = 80;
  const auto descent = MakeLocalSearcher(search, best);
  for (int i = 0; i < kSteps; ++i) {
    const std::vector<UnitPoint> asked = descent->Ask();
    if (asked.empty()) break;
    const Judgement judgement = judge(asked.front());
    if (IsBetter(judgement, least)) least = judgement;
    descent->Tell({judgement});
  }
  return least.objectives.front();
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
    const auto test = [&](double fraction) {
      point[1] = Interpolate(y, fraction);
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

namespace {

/// (57) of all axes at some values of the keys.
struct Axes {
  SampledLoop loop;
  std::array<AxisGains, 6> gains;
};

Axes FindAxes(const StudyInputs& inputs, const std::vector<double>& parameters) {
  const Scenario scenario = MakeTrialScenario(inputs, {0, 0, parameters});
  Axes axes{MakeLoop(scenario), {}};
  for (int axis = 0; axis < 6; ++axis) axes.gains[static_cast<size_t>(axis)] = GainsOf(scenario, axis);
  return axes;
}

bool Holds(const Axes& axes, unsigned which, bool is_stability) {
  for (size_t axis = 0; axis < axes.gains.size(); ++axis) {
    if ((which >> axis & 1U) == 0) continue;
    const bool holds = is_stability ? CalcSpectralRadius(axes.loop, axes.gains[axis]) < 1.0
                                    : IsDamped(axes.loop, axes.gains[axis]);
    if (!holds) return false;
  }
  return true;
}

/// Calls `found` with each value of the key at which the axes `which` turn.
void FindTurnsAlong(const StudyInputs& inputs, std::vector<double> parameters, size_t key, unsigned which,
                    int rows, const std::function<void(bool is_stability, double value)>& found) {
  constexpr int kBisect = 10;
  const Variation& variation = inputs.study.variations[key];
  const auto at = [&](double fraction) {
    parameters[key] = Interpolate(variation, fraction);
    return FindAxes(inputs, parameters);
  };
  Axes before = at(0.0);
  for (int j = 1; j <= rows; ++j) {
    const Axes after = at(static_cast<double>(j) / rows);
    for (const bool is_stability : {true, false}) {
      const bool held = Holds(before, which, is_stability);
      if (held == Holds(after, which, is_stability)) continue;
      double low = static_cast<double>(j - 1) / rows;
      double high = static_cast<double>(j) / rows;
      for (int k = 0; k < kBisect; ++k) {
        const double middle = 0.5 * (low + high);
        (Holds(at(middle), which, is_stability) == held ? low : high) = middle;
      }
      found(is_stability, Interpolate(variation, high));
    }
    before = after;
  }
}

/// Axes, as bits, on which (57) is another one at the key's other end.
unsigned FindChangedAxes(const StudyInputs& inputs, std::vector<double> parameters, size_t key) {
  const Variation& variation = inputs.study.variations[key];
  if (!variation.labels.empty()) return 0;
  parameters[key] = variation.from;
  const Axes from = FindAxes(inputs, parameters);
  parameters[key] = variation.to;
  const Axes to = FindAxes(inputs, parameters);
  unsigned which = 0;
  for (size_t axis = 0; axis < from.gains.size(); ++axis) {
    if (!(from.loop == to.loop) || !(from.gains[axis] == to.gains[axis])) which |= 1U << axis;
  }
  return which;
}

}  // namespace

KeyTheory FindKeyTheory(const StudyInputs& inputs, const std::vector<double>& parameters) {
  constexpr int kRowsAlong = 32;
  constexpr int kRowsOfCurve = 12;
  constexpr int kColumnsOfCurve = 24;
  constexpr size_t kMostPairs = 4;
  const size_t keys = inputs.study.num_keys();
  KeyTheory theory;
  std::vector<unsigned> axes;
  try {
    for (size_t key = 0; key < keys; ++key) {
      axes.push_back(FindChangedAxes(inputs, parameters, key));
      theory.knows.push_back(axes.back() != 0);
      if (axes.back() == 0) continue;
      FindTurnsAlong(inputs, parameters, key, axes.back(), kRowsAlong, [&](bool is_stability, double value) {
        theory.turns.push_back({key, is_stability, value});
      });
    }
    size_t pairs = 0;
    for (size_t x = 0; x < keys; ++x) {
      for (size_t y = x + 1; y < keys && pairs < kMostPairs; ++y) {
        if ((axes[x] & axes[y]) == 0) continue;
        ++pairs;
        KeyTheory::Curve stability{x, y, true, {}};
        KeyTheory::Curve damping{x, y, false, {}};
        std::vector<double> point = parameters;
        for (int i = 0; i <= kColumnsOfCurve; ++i) {
          point[x] = Interpolate(inputs.study.variations[x], static_cast<double>(i) / kColumnsOfCurve);
          FindTurnsAlong(inputs, point, y, axes[x] & axes[y], kRowsOfCurve,
                         [&](bool is_stability, double value) {
                           (is_stability ? stability : damping).points.emplace_back(point[x], value);
                         });
        }
        for (KeyTheory::Curve* curve : {&stability, &damping}) {
          if (!curve->points.empty()) theory.curves.push_back(std::move(*curve));
        }
      }
    }
  } catch (const InputError&) {  // values that make no scenario: there is no more to say
  }
  theory.knows.resize(keys, false);
  return theory;
}

}  // namespace dexcheck
