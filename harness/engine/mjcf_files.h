#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace dexcheck {

/// Files of an MJCF model: the file itself, what it includes, and its meshes, height fields and textures, as
/// paths relative to its folder; itself first.
/// @throws InputError when one cannot be read or lies outside that folder.
std::vector<std::string> ListMjcfFiles(const std::filesystem::path& mjcf);

}  // namespace dexcheck
