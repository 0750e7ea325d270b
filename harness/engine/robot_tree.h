#pragma once

// Which of an engine's model's trees is the robot: scenes have objects besides, and published robots parts
// that are parked in the world.

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

namespace dexcheck {

/// What carries the robot of a model.
struct RobotTree {
  /// The body that a free joint moves and that carries the robot's joints; 0 when its base is fixed.
  int floating_body = 0;
  /// Names of the bodies that carry what is no part of it.
  std::vector<std::string> others;
};

/// All bodies on the world are one robot with a fixed base; a body with a free joint and all that it carries
/// is one that floats. The robot has the most joints, free ones not counted; a single body that floats is one
/// when nothing else moves.
/// @throws InputError with `source` when two have as many.
RobotTree FindRobotTree(const mjModel& engine, const std::string& source);

/// The floating body that carries a joint; 0 when the world does.
int FindTree(const mjModel& engine, int joint);

}  // namespace dexcheck
