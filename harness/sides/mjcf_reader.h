#pragma once

// A table of parameters from an engine's model: the mechanism as the engine compiled it.

#include <mujoco/mujoco.h>

#include <string>

#include "harness/sides/robot_description.h"

namespace dexcheck {

/// Reads the mechanism of an engine's model: hinges and slides on a fixed base or on one body with a free
/// joint, masses, couplings by equality/joint, named sites. A body's own frame is kept
/// (DescribedJoint::X_iL); frame i stands at the joint's anchor. A body with several joints becomes as many
/// links, of which the last carries the mass. What a table has no place for is noted.
/// @throws InputError for ball joints, and for free joints but one that carries all that moves.
RobotDescription ReadMjcfDescription(const mjModel& engine, const std::string& source);

/// The body that a free joint moves and that carries all other joints; -1 when there is none.
int FindFloatingBase(const mjModel& engine);

}  // namespace dexcheck
