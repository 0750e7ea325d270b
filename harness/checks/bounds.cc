// Scaling of the bounds of check_table.cc with a scenario's changes.

#include <algorithm>

#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/checks/check_table.h"

namespace dexcheck {
namespace {

// Values of the shipped scenarios.
constexpr double kShippedGain = 400.0;    // K_p, 1/s^2
constexpr double kShippedPosture = 10.0;  // rad/s

double Square(double x) { return x * x; }

/// Returns the scale by the numbers of the engine's contacts, which a rigid plant has not.
double CalcContactScale(Scaling scaling, const PlantOptions& plant) {
  const double dt = plant.time_step;
  const double softness = 1.0 - plant.contact_impedance;
  switch (scaling) {
    case Scaling::kSofter:
      return Worst(softness, 1.0 - PlantOptions{}.contact_impedance);
    case Scaling::kCreep:
      return softness * dt;
    case Scaling::kLag:
      return dt;
    case Scaling::kSinking:
    case Scaling::kPosture:
      return softness * dt * dt;
    case Scaling::kSinkingRate:
      return softness * FindContactTimeConstant(plant);
    default:
      return 1.0;
  }
}

double CalcGainScale(const Vector3d& K_p) {
  // Gains that do not settle fail a check of their own.
  return K_p.minCoeff() > 0.0 ? kShippedGain / K_p.minCoeff() : 1.0;
}

/// Returns the quantity that a bound is proportional to, over its value for the shipped plant and gains.
double CalcScale(Scaling scaling, const Scenario& scenario) {
  const ControlOptions& control = scenario.control;
  if (scaling == Scaling::kPositionGain) return CalcGainScale(control.gains.K_p.head<3>());
  if (scaling == Scaling::kOrientationGain) return CalcGainScale(control.gains.K_p.tail<3>());
  if (scaling == Scaling::kSquaredStep) return Square(scenario.plant.time_step / PlantOptions{}.time_step);
  double scale = scaling == Scaling::kPosture && control.posture_frequency > 0.0
                     ? Square(kShippedPosture / control.posture_frequency)
                     : 1.0;
  if (scenario.plant.type == PlantType::kEngine)
    scale *= CalcContactScale(scaling, scenario.plant) / CalcContactScale(scaling, PlantOptions{});
  return scale;
}

}  // namespace

std::string Bound::Print() const { return formula != nullptr ? formula : FormatNumber(shipped, 3); }

double FindContactTimeConstant(const PlantOptions& plant) {
  return plant.contact_time_constant > 0.0 ? plant.contact_time_constant : 2.0 * plant.time_step;
}

double CalcBound(const CheckInfo& info, const Scenario& scenario) {
  const double bound = info.bound.shipped * CalcScale(info.bound.scaling, scenario);
  // A sum whose terms partly cancel has one digit less than its terms.
  constexpr double kLost = 10.0;
  return info.bound.is_relative ? Worst(bound, kLost * scenario.tolerance) : bound;
}

double CalcStatedBound(const CheckInfo& info, const BoundOverride& stated, const Scenario& scenario) {
  const Scenario* const written = scenario.written.get();
  const bool is_written =
      written != nullptr && std::ranges::find(written->bounds, stated) != written->bounds.end();
  if (!is_written) return stated.second;
  return stated.second * CalcScale(info.bound.scaling, scenario) / CalcScale(info.bound.scaling, *written);
}

void RequireKnownBounds(const Scenario& scenario) {
  for (const auto& [name, bound] : scenario.bounds) {
    if (FindCheck(name) != nullptr) continue;
    throw InputError(scenario.source + ": bounds." + name + ": no check has this name");
  }
}

}  // namespace dexcheck
