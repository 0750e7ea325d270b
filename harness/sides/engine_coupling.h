#pragma once

#include <mujoco/mujoco.h>

#include <optional>

#include "harness/sides/robot_description.h"

namespace dexcheck {

/// The coupling that an active equality/joint of first order gives to a joint of the engine's model; `leader`
/// is the engine's joint. None when there is no such constraint.
std::optional<JointCoupling> FindEngineCoupling(const mjModel& engine, int joint);

}  // namespace dexcheck
