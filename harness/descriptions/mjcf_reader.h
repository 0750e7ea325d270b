#pragma once

// A table of parameters from an engine's model: the mechanism as the engine compiled it.

#include <mujoco/mujoco.h>

#include <string>

#include "harness/descriptions/robot_description.h"
#include "harness/engine/mjcf_file.h"

namespace dexcheck {

/// Reads the mechanism of an engine's model: hinges and slides on a fixed base or on one body with a free
/// joint, masses, couplings by equality/joint, named sites. A body's own frame is kept
/// (DescribedJoint::X_iL); frame i stands at the joint's anchor. A body with several joints becomes as many
/// links, of which the last carries the mass. What a table has no place for is noted.
/// Reads the tree with the most joints as the robot (robot_tree.h).
/// @throws InputError for free joints within it, and where nothing moves.
RobotDescription ReadMjcfDescription(const mjModel& engine, const std::string& source);

/// Mass properties of one of the engine's bodies, in its own frame.
MassProperties ReadEngineBody(const mjModel& engine, int body);

/// The text of an MJCF without what has no effect on the mechanism: looks, contacts, actuators.
std::string ReduceToMechanism(const MjcfFile& mjcf);

}  // namespace dexcheck
