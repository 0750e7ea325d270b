#pragma once

#include <filesystem>

#include "harness/engine/joined_mjcf.h"

namespace dexcheck {

/// Puts one torque motor for each joint of the robot in the place of all of an MJCF's actuators, as a run
/// needs them: servos, muscles and tendons are what a controller here replaces. A motor's limit is what the
/// joint's actuator could give; sensors of actuators and the controls of key frames go with them.
/// @param folder the one from which the MJCF's own files are found.
/// @throws InputError when the engine cannot load it, or a joint has no name.
void AddMotors(const std::filesystem::path& folder, JoinedMjcf* mjcf);

}  // namespace dexcheck
