#pragma once

// Inertias that an MJCF states as fullinertia, as MuJoCo's compiler changes them.

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

/// Principal moments of an inertia by size, kg m^2.
Vector3d CalcMoments(const Matrix3d& inertia);

/// The inertial elements of an MJCF by the engine's body, depth first, nullptr for bodies without; empty
/// where elements make bodies of their own.
std::vector<const tinyxml2::XMLElement*> ListInertials(const MjcfFile& mjcf, const mjModel& engine);
/// The tensor that an inertial states in its body's axes; none when it states no fullinertia, and when what
/// the engine compiled is farther from it than its search for principal axes leaves it.
std::optional<Matrix3d> ReadFullInertia(const tinyxml2::XMLElement& inertial, const Matrix3d& compiled);

/// A body whose mass or inertia a setting of the compiler changed.
struct CompiledChange {
  std::string body;
  std::string setting;         ///< "boundmass", "boundinertia, balanceinertia"
  std::vector<double> stated;  ///< Mass, kg, or principal moments by size, kg m^2, as the text has them.
  std::vector<double> made;    ///< Numbers of the engine's model.
};

/// Bodies whose stated mass or inertia is not that of the engine's model.
std::vector<CompiledChange> ListCompiledChanges(const MjcfFile& mjcf, const mjModel& engine);

/// The engine has principal moments and axes, and finds them of a tensor to 1e-8 of its size or, for slender
/// bodies, 1e-6. Gives each body of a description whose inertia is, to rounding, the one that the MJCF states
/// so the inertia that the engine made of it: the difference is the engine's, and no fault of the file.
/// @param robot as CompleteFromEngine left it. @return a note, when there are such bodies.
std::optional<std::string> TakeCompiledInertias(const MjcfFile& mjcf, const mjModel& engine,
                                                RobotDescription* robot);

}  // namespace dexcheck
