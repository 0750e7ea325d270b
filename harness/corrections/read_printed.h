#pragma once

// Files read as they print their numbers.

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "harness/corrections/printed_robot.h"
#include "harness/descriptions/read_description.h"

namespace dexcheck {

/// The robot of a file. Of an MJCF, bodies that state no inertial have the engine's, and so has what this
/// reads otherwise than the engine.
/// @param carrier whose robot has the bodies of a table of bodies. @throws InputError for what is no
/// description, and for such a table without it.
PrintedRobot ReadPrintedRobot(const DescriptionFile& file, const DescriptionFile* carrier = nullptr);

/// Reads a URDF's text. @throws InputError.
PrintedRobot ReadPrintedUrdf(const std::string& text, const std::string& source);

/// Reads an MJCF that is one document. @param engine what the engine compiled of it.
PrintedRobot ReadPrintedMjcf(const MjcfFile& mjcf, const mjModel& engine);

/// Reads a table, whose angles are in degrees: each number has the digits of its shortest decimal text.
PrintedRobot PrintDescription(const RobotDescription& robot);

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

/// Numbers between blanks or commas. A zero stands for each that is missing.
template <int N>
std::pair<Eigen::Matrix<double, N, 1>, Eigen::Matrix<double, N, 1>> ReadPrintedVector(std::string_view text);
std::optional<PrintedScalar> ReadPrintedScalar(std::string_view text);

}  // namespace dexcheck
