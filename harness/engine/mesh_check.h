#pragma once

#include <filesystem>
#include <string>

namespace dexcheck {

/// What the engine cannot read of a mesh's file (STL, OBJ or MSH): "does not exist", "face 12 has vertex 900
/// of 60". Empty when it can. The engine's own readers follow indices without looking at them.
std::string FindMeshFault(const std::filesystem::path& file);

}  // namespace dexcheck
