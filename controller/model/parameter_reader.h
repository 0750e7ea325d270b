#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "controller/model/robot_model.h"

namespace dexcheck {

/// Reads a robot from a parameter file; controller/parameters/assistant_robot.toml shows every key.
/// @throws InputError, one line that names file, line, key and value, for anything that is not a robot: also
/// for unknown keys, so that a misspelt one is never ignored.
RobotModel ReadRobotModel(const std::filesystem::path& path);

/// The same for a text; `source` stands for the file in messages.
/// @param overrides "PATH=VALUE" each, set in place of the file's values (TomlDocument::Override).
RobotModel ParseRobotModel(std::string_view text, std::string_view source,
                           std::span<const std::string> overrides = {});

}  // namespace dexcheck
