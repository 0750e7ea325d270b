#pragma once

// A file with the causes corrected by which it differs from another one.

#include <filesystem>
#include <string>

#include "harness/corrections/printed_robot.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// Returns the text of `file` with its numbers corrected until it agrees with `reference`, or as far as
/// corrections are known. A URDF and an MJCF keep their other elements, a parameter file its other keys.
/// @param folder in which the text will stand: an MJCF finds its meshes from there.
/// @throws InputError "FILE: cannot be repaired: why" for what the file has no attribute or key for.
std::string WriteRepaired(const DescriptionFile& file, const UrdfOptions& urdf, PrintedRobot reference,
                          const std::vector<std::string>& ignore, const std::filesystem::path& folder);

}  // namespace dexcheck
