#pragma once

#include <string>
#include <vector>

#include "harness/scenario/scenario.h"

namespace dexcheck {

/// A scenario as a file that stands anywhere: its text with assignments made in it, files with their whole
/// paths, and a name of its own.
/// @throws InputError when the assignments do not fit.
std::string MakeScenarioText(const Scenario& scenario, const std::vector<std::string>& overrides,
                             const std::string& name);

}  // namespace dexcheck
