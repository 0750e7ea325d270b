#pragma once

#include <filesystem>

#include "harness/descriptions/robot_description.h"
#include "harness/descriptions/urdf_reader.h"

namespace dexcheck {

/// Reads a parameter file, a URDF, or an MJCF (as the engine compiles it). @throws InputError.
RobotDescription ReadDescription(const std::filesystem::path& path, const UrdfOptions& options = {});

}  // namespace dexcheck
