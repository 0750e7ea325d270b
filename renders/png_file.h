#pragma once

#include <filesystem>

#include "renders/image.h"

namespace dexcheck {

/// Writes the whole picture or nothing. @throws InputError "PATH: cannot be written: reason".
void WritePng(const std::filesystem::path& path, const Image& image);

/// @throws InputError "PATH: cannot be read: reason".
Image ReadPng(const std::filesystem::path& path);

}  // namespace dexcheck
