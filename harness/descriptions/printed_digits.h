#pragma once

// The precision of numbers printed in a file: each is known to half a unit of its last digit.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// Digits of one decimal number as it is printed.
struct PrintedNumber {
  double value = 0.0;
  int digits = 0;          ///< Significant ones.
  double half_unit = 0.0;  ///< To which it is known; 0: it is exact.
};

/// Reads a decimal number, which is known to half a unit of its last digit. A number stands for at least
/// three significant digits: people type 0.5 and 0.0001, and mean 0.500 and 0.000100. A whole number with
/// fewer than four decimals (0, 1, 90.0) is exact.
/// @return nothing where the text is no decimal number.
std::optional<PrintedNumber> ReadPrinted(std::string_view text);

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
