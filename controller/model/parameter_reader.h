#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "controller/common/types.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// How a joint's row stands in its parameter file, as far as the specification does not say it.
struct WrittenRow {
  /// The link's own frame L, in which the file gives its mass and what hangs on it, in frame i.
  Pose X_iL = Pose::Identity();
  bool is_plain = false;  ///< A plain transform (xyz, rpy, axis), not Denavit-Hartenberg parameters.
  Vector3d rpy = Vector3d::Zero();  ///< Of a plain transform, rad.
  // Whether the file states these constants of the joint. What it does not state is zero in the model.
  bool states_damping = true;
  bool states_dry_friction = true;
  bool states_armature = true;
};

class TomlDocument;

/// Reads a robot from a parameter file; controller/parameters/assistant_robot.toml shows every key.
/// @throws InputError, one line that names file, line, key and value, for anything that is not a robot: also
/// for unknown keys, so that a misspelt one is never ignored.
/// @param rows filled with how the joints' rows are written, unless null.
RobotModel ReadRobotModel(const std::filesystem::path& path, std::vector<WrittenRow>* rows = nullptr);

/// Reads a robot from a text; `source` stands for the file in messages.
/// @param overrides "PATH=VALUE" each, set in place of the file's values (TomlDocument::Override).
RobotModel ParseRobotModel(std::string_view text, std::string_view source,
                           std::span<const std::string> overrides = {},
                           std::vector<WrittenRow>* rows = nullptr);

/// Reads a robot from a parsed document, which saves half of the work.
RobotModel ParseRobotModel(TomlDocument document, std::string_view source,
                           std::span<const std::string> overrides, std::vector<WrittenRow>* rows = nullptr);

}  // namespace dexcheck
