#pragma once

// Files read as they print their numbers.

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

/// Numbers between blanks or commas. A zero stands for each that is missing.
template <int N>
std::pair<Eigen::Matrix<double, N, 1>, Eigen::Matrix<double, N, 1>> ReadPrintedVector(std::string_view text);
std::optional<PrintedScalar> ReadPrintedScalar(std::string_view text);

}  // namespace dexcheck
