#pragma once

// What kind of description a file holds.

#include <filesystem>
#include <string>
#include <string_view>

namespace dexcheck {

enum class RobotFormat { kToml, kUrdf, kMjcf };

/// By content: XML whose root element is <robot> or <mujoco>, or else a parameter file.
/// @throws InputError "FILE: must be ..." for other XML.
RobotFormat FindFormat(std::string_view text, const std::string& source);

/// The format of a file; without a root element it is that of the name's end, so that an empty .xml is no
/// parameter file. @throws InputError also when it cannot be read.
RobotFormat FindFormat(const std::filesystem::path& path);

}  // namespace dexcheck
