#pragma once

#include <mujoco/mujoco.h>

#include <optional>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// The active equality/joint of first order that makes a joint of the engine's model follow another one; -1
/// when there is none.
int FindCouplingConstraint(const mjModel& engine, int joint);

/// The coupling that such a constraint gives to a joint of the engine's model; `leader`
/// is the engine's joint. None when there is no such constraint.
std::optional<JointCoupling> FindEngineCoupling(const mjModel& engine, int joint);

}  // namespace dexcheck
