#pragma once

// A file with the causes corrected by which it differs from another one.

#include <filesystem>
#include <string>

#include "harness/corrections/printed_robot.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// The text of a repaired file, and whether no cause is left by which its printed numbers differ.
struct RepairedFile {
  std::string text;
  bool agrees = false;
};

/// Returns the text of `file` with its numbers corrected until it agrees with `reference`, or as far as
/// corrections are known. A URDF and an MJCF keep their other elements, a parameter file its other keys.
/// @param printed the robot of the file, without what the two files need not share.
/// @param folder in which the text will stand: an MJCF finds its meshes from there.
/// @throws InputError "FILE: cannot be repaired: why" for what the file has no attribute or key for.
RepairedFile WriteRepaired(const DescriptionFile& file, const PrintedRobot& printed,
                           const PrintedRobot& reference, const std::filesystem::path& folder);

/// Returns the text of `file` with the numbers of `after` where they are not those of `before`, which it
/// prints. Comments stay. @throws InputError as WriteRepaired.
std::string WriteNumbers(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after,
                         const std::filesystem::path& folder);

}  // namespace dexcheck
