#pragma once

// What MuJoCo's compiler makes of the inertias that an MJCF states as fullinertia.

#include <mujoco/mujoco.h>

#include <optional>
#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "harness/engine/mjcf_file.h"

namespace tinyxml2 {
class XMLElement;
}

namespace dexcheck {

/// The inertial elements of an MJCF by the engine's body, depth first, nullptr for bodies without; empty
/// where elements make bodies of their own.
std::vector<const tinyxml2::XMLElement*> ListInertials(const MjcfFile& mjcf, const mjModel& engine);
/// The tensor that an inertial states in its body's axes; none when it states no fullinertia.
std::optional<Matrix3d> ReadFullInertia(const tinyxml2::XMLElement& inertial);

/// The engine has principal moments and axes, and finds them of a tensor to 1e-8 of its size or, for slender
/// bodies, 1e-6. Gives each body of a description whose inertia is, to rounding, the one that the MJCF states
/// so the inertia that the engine made of it: the difference is the engine's, and no fault of the file.
/// @param robot as CompleteFromEngine left it. @return a note, when there are such bodies.
std::optional<std::string> TakeCompiledInertias(const MjcfFile& mjcf, const mjModel& engine,
                                                RobotDescription* robot);

}  // namespace dexcheck
