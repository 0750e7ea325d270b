#pragma once

// An MJCF from a description of a robot, where its user has none.

#include <string>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// The mechanism as an MJCF: a body for each joint's link, in frame i of that joint, with principal moments
/// to rounding; limits, damping, armature, friction and frames (as sites). It has no shapes, no couplings and
/// no actuators. What is wrong in the description is wrong in it.
/// @param origin what it was made from, for its first comment.
/// @throws InputError for a base that moves and for ball joints.
std::string WriteMjcf(const RobotDescription& robot, const std::string& origin);

}  // namespace dexcheck
