#pragma once

// The bounds of questions two to five: one number each for the shipped plant and gains, in
// step_check_table.h, and how it scales with what a scenario changes.

#include <algorithm>

#include "harness/checks/step_check_table.h"
#include "harness/scenario/scenario.h"

namespace dexcheck {

/// tc of the scenario's contacts, s: twice the time step unless it says otherwise.
[[nodiscard]] double FindContactTimeConstant(const PlantOptions& plant);

/// What a bound is proportional to, over what that is for the shipped plant and gains.
[[nodiscard]] double CalcScale(Scaling scaling, const Scenario& scenario);

/// The bound of a check in that scenario, but for what the scenario itself says under [bounds] and [expect].
[[nodiscard]] inline double CalcBound(const StepCheckInfo& info, const Scenario& scenario) {
  const double bound = info.bound * CalcScale(info.scaling, scenario);
  // What is formed of several terms, parts of which cancel, has a digit less than they.
  constexpr double kLost = 10.0;
  return info.is_relative ? std::max(bound, kLost * scenario.tolerance) : bound;
}

/// A bound that the scenario itself states: for the plant and the gains of its file. Where these are set
/// otherwise the bound follows by its formula, unless it is set, too.
[[nodiscard]] double CalcStatedBound(const StepCheckInfo& info, const BoundOverride& stated,
                                     const Scenario& scenario);

}  // namespace dexcheck
