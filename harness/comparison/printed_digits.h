#pragma once

// The precision of numbers printed in a file: each is known to half a unit of its last digit.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/corrections/read_printed.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// The numbers of one file that describe the mechanism and are not exact. A number of a joint that stands in
/// the other file, as often at least, is exact besides: it leaves nothing open between the two.
struct PrintedDigits {
  std::string file;
  int count = 0;
  int fewest = 0;  ///< Significant digits, and
  int most = 0;
};

/// A file's description, and the same with each of these numbers moved by its half unit, up or down at
/// random.
struct PrintedSpread {
  PrintedDigits digits;
  RobotDescription nominal;
  std::vector<RobotDescription> draws;
  /// An MJCF's with each fullinertia as the file states it: the engine diagonalises them to 3e-7 of their
  /// size.
  std::optional<RobotDescription> undiagonalized;
};

/// Reads two files of one robot again `count` times with these numbers moved. Of an MJCF, what has no effect
/// on the mechanism (looks, contacts, actuators) is left out.
/// @return nothing when one of them can be no description, or its numbers cannot be moved.
std::optional<std::array<PrintedSpread, 2>> DrawWithinDigits(
    const std::array<const DescriptionFile*, 2>& files, const UrdfOptions& options, int count);

}  // namespace dexcheck
