#pragma once

// The sliders of a live run: factors of a scenario's gains.

#include <string>
#include <vector>

#include "harness/scenario/scenario.h"
#include "harness/view/controls.h"

namespace dexcheck {

/// Of K_p, K_v and, where an object is held, f_min, each at the scenario's own.
std::vector<Slider> MakeGainSliders(const Scenario& scenario);

/// Assignments that multiply a scenario's gains. @param sliders as MakeGainSliders made them, moved since.
std::vector<std::string> MakeGainOverrides(const Scenario& scenario, const std::vector<Slider>& sliders);

/// A scenario as a file that stands anywhere: its text with assignments made in it, files with their whole
/// paths, and a name of its own.
/// @throws InputError when the assignments do not fit.
std::string MakeScenarioText(const Scenario& scenario, const std::vector<std::string>& overrides,
                             const std::string& name);

}  // namespace dexcheck
