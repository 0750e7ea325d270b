#pragma once

// Shapes and meshes of a URDF's links, which dynamics do not need.

#include <filesystem>
#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "harness/descriptions/urdf_file.h"

namespace dexcheck {

/// What can touch, or else what is seen. Nothing behind a broken shape is read.
std::vector<DescribedShape> ReadShapes(const UrdfFile& file, const UrdfLink& link);

/// Files of the meshes that are in none of the packages, each once. @param folder of the URDF.
std::vector<std::string> ListMissingMeshes(const UrdfFile& file, const std::filesystem::path& folder,
                                           const std::vector<std::filesystem::path>& packages);

}  // namespace dexcheck
