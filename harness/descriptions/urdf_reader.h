#pragma once

// A robot from a URDF, by this project's own code: the engine's importer is itself a suspect.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

struct UrdfOptions {
  /// Folders of "package://NAME/...": they contain NAME, or are NAME. When there are some,
  /// meshes that are missing are noted; dynamics need none.
  std::vector<std::filesystem::path> packages;
  /// The root link moves freely. Otherwise it is fixed when it is called "world", floats when the only joint
  /// on it is of the type "floating", and of others the file does not say: RobotDescription::states_base.
  bool floating = false;
  /// Bodies without dynamics, as of negative mass, are kept for an audit; a RobotModel refuses them.
  bool keep_impossible = false;
};

/// Reads a URDF's text, for which `source` stands in messages: links joined by fixed joints are one body,
/// named by the link that the moving joint carries; the others become frames. Joints come depth first in the
/// file's order. The link's own frames are kept (DescribedJoint::X_iL); frame i has its z axis along the
/// joint's.
/// @throws InputError, one line that names file, line, part and value.
RobotDescription ParseUrdf(std::string_view text, const std::string& source, const UrdfOptions& options = {});

}  // namespace dexcheck
