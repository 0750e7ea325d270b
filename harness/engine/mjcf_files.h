#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace dexcheck {

/// Files of an MJCF model: the file itself, what it includes, and its meshes, height fields and textures, as
/// paths relative to its folder; itself first.
/// @throws InputError when one cannot be read or lies outside that folder.
std::vector<std::string> ListMjcfFiles(const std::filesystem::path& mjcf);

/// An MJCF's text for another folder, `to` instead of `from`: what it includes, and the folders of its meshes
/// and textures, are found from there. Folders that an included file states stay as they are.
/// @param source in messages. @throws InputError when it is not well-formed.
std::string MoveMjcf(const std::string& text, const std::string& source, const std::filesystem::path& from,
                     const std::filesystem::path& to);

}  // namespace dexcheck
