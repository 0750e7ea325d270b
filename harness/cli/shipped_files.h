#pragma once

#include <filesystem>

namespace dexcheck::cli {

/// Path of a file that comes with the program, such as "mjcf/scene.xml": in ../share/dexcheck beside the
/// executable when it is there (an installed program, wherever its tree was moved), otherwise in the folder
/// that the program was built from. @throws InputError when it is in neither.
std::filesystem::path FindShippedFile(const std::filesystem::path& name);

}  // namespace dexcheck::cli
