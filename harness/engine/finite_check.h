#pragma once

#include <mujoco/mujoco.h>

#include <string>

#include "harness/engine/joined_mjcf.h"

namespace dexcheck {

/// The engine compiles numbers that are not finite into its model and warns at most. This throws instead.
/// @throws InputError "SOURCE: body "NAME": mass must be finite, got nan" for the first such number of the
/// MJCF's options, bodies, joints, geoms, sites and contact pairs, and for a nan anywhere else.
void CheckFinite(const mjModel& model, const std::string& source);

/// Of single integers and of lists of numbers the engine reads what it can and drops the rest: 1 of "1,5".
/// Takes off blanks at which it reads a number twice.
/// @throws InputError "FILE:LINE: <size nconmax>: must be an integer, got "1,5"".
void CheckNumbers(JoinedMjcf* mjcf);

}  // namespace dexcheck
