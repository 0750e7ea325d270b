#pragma once

#include <string>
#include <string_view>

namespace dexcheck {

/// A URDF as the engine's own importer should read it: without looks and collision shapes, whose meshes
/// nobody needs, without inertials of what is fixed to the world, each link a body of its own (<compiler
/// fusestatic="false"/>), and the root on a floating joint when it floats.
/// @throws InputError as UrdfFile.
std::string WriteEngineUrdf(std::string_view text, const std::string& source, bool floats);

}  // namespace dexcheck
