#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace dexcheck {

/// Makes a file below a folder, which it makes when it is not there, as the folders between. It follows no
/// link below the folder, and replaces nothing.
/// @param name IsPlainPath.
/// @throws InputError "PATH: cannot be written: reason".
void ExtractFile(const std::filesystem::path& folder, const std::string& name, std::string_view bytes);

}  // namespace dexcheck
