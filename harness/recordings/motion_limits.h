#pragma once

// Within what a robot may move while its motion is recorded.

#include <filesystem>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// By joint, in the model's order.
struct MotionLimits {
  VectorXd lower, upper;            ///< Of the position, rad or m.
  VectorXd velocity, acceleration;  ///< At most, rad/s and rad/s^2, or m.
  VectorXd torque;                  ///< At most, N m or N; infinite where nothing limits it.
};

/// The description's ranges less a twentieth at either end, half a turn or half a metre about zero where it
/// states none, 1 rad/s (0.25 m/s) and 4 rad/s^2 (1 m/s^2); or what a TOML file says:
///
///     [all]                # of every joint
///     velocity = 0.8
///     [joints.elbow]       # of one
///     lower = -1.0
///     upper = 1.2
///     velocity = 1.5
///     acceleration = 5.0
///     torque = 40.0
///
/// @param file empty for none. @throws InputError, one line, when it has an unknown joint or key or a range
/// without width.
MotionLimits ReadMotionLimits(const RobotDescription& robot, const std::filesystem::path& file);

}  // namespace dexcheck
