#pragma once

// How small a force, or an error of a mass, a friction, an inertia, may be and still be found and named by
// what a run leaves of the balances.

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "harness/run/runner.h"

namespace dexcheck {

/// One amplitude of a fault.
struct Detectability {
  std::string fault, place, unit;  ///< As Fault's.
  int component = 0;               ///< Of a vector or a tensor.
  // The smallest that is found and named, infinite where none is.
  double found = std::numeric_limits<double>::infinity();
  double named = std::numeric_limits<double>::infinity();
  std::string rival;  ///< What is told from it last; empty for none.
};

/// Runs a scenario and asks the estimator of causes how small each fault of the balances may be, to first
/// order: to be found with the noise of the checks' bounds, and to be named with that of this run.
/// @param states how many steps are looked at, evenly over the run.
/// @returns none where it was stopped. @throws InputError for a task; when the run fails.
std::vector<Detectability> FindDetectability(const Setup& setup, int states,
                                             const std::function<bool()>& should_stop);

}  // namespace dexcheck
