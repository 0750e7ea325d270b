#pragma once

#include <mujoco/mujoco.h>

#include <string>

namespace dexcheck {

/// The engine compiles numbers that are not finite into its model and warns at most. This throws instead.
/// @throws InputError "SOURCE: body "NAME": mass must be finite, got nan" for the first such number of the
/// MJCF's options, bodies, joints, geoms, sites and contact pairs, and for a nan anywhere else.
void CheckFinite(const mjModel& model, const std::string& source);

}  // namespace dexcheck
