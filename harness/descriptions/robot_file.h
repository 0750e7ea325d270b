#pragma once

// What kind of description a file holds.

#include <filesystem>
#include <string_view>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// By content: XML whose root element is <robot> or <mujoco>, or else a parameter file. XML without a root
/// element has the format of the name's end, so that an empty .xml is no parameter file.
/// @throws InputError "FILE: must be ..." for other XML.
RobotFormat FindFormat(std::string_view text, const std::filesystem::path& path);

/// The same of a file. @throws InputError also when it cannot be read.
RobotFormat FindFormat(const std::filesystem::path& path);

}  // namespace dexcheck
