#pragma once

#include <string>
#include <string_view>

namespace dexcheck {

/// A URDF as the engine's own importer should read it: without looks and collision shapes, whose meshes
/// nobody needs, without inertials of what is fixed to the world, each link a body of its own (<compiler
/// fusestatic="false"/>), and the root on a floating joint when it floats.
/// @throws InputError "SOURCE: ..." when it is no URDF.
std::string WriteEngineUrdf(std::string_view text, const std::string& source, bool floats);

/// A URDF without the robot's materials. @throws InputError "SOURCE: ..." when it is no URDF.
std::string RemoveMaterials(std::string_view text, const std::string& source);

/// A URDF whose joints without a name are called "#" and their number in the file, as UrdfJoint::name.
/// @throws InputError "SOURCE: ..." when it is no URDF.
std::string NameJoints(std::string_view text, const std::string& source);

}  // namespace dexcheck
