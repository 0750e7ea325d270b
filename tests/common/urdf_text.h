#pragma once

// Robots as URDF text, written for the tests from the analytic model's specification.

#include <random>
#include <string>

#include "controller/model/robot_model.h"

namespace dexcheck::testing {

/// The robot as a URDF whose link frames are turned at random against the specification's frames
/// (not at all when `random` is null), whose inertials have frames of their own, and of whose links
/// some carry a second body by a fixed joint: its mass is added to the specification. Fixed and floating
/// bases.
/// @param dry_friction of every joint.
std::string WriteUrdf(RobotSpec* spec, std::mt19937* random, double dry_friction = 0.0);

}  // namespace dexcheck::testing
