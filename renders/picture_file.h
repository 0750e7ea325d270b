#pragma once

#include <filesystem>

#include "renders/image.h"

namespace dexcheck {

/// @throws InputError unless the name ends in .png, .jpg or .jpeg, in small or capital letters.
void RequirePictureName(const std::filesystem::path& path);

/// Writes a PNG or a JPEG (4:4:4, quality about 95), as the name says. The file appears whole or not at all.
/// @throws InputError "PATH: cannot be written: reason", or as RequirePictureName.
void WritePicture(const std::filesystem::path& path, const Image& image);

/// @throws InputError "PATH: cannot be read: reason".
Image ReadPng(const std::filesystem::path& path);

}  // namespace dexcheck
