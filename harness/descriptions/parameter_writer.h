#pragma once

// A parameter file from a description of a robot.

#include <string>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Angles [roll, pitch, yaw], rad, with R = Rz(yaw) Ry(pitch) Rx(roll) to rounding, for every rotation.
Vector3d CalcRollPitchYaw(const Matrix3d& R);

/// In the first comment of what WriteParameters writes.
inline constexpr const char* kImportMark = "# Parameters of one robot, written by dexcheck import from ";

/// The robot as a commented parameter file (TOML) that ReadRobotModel reads back to the same model, to
/// rounding. Each joint is a plain transform; bodies and frames are given in their link's own axes, at the
/// joint.
/// @param origin what the file was made from, for the first comment.
/// @throws InputError for a base or an object that this cannot write (only fixed bases, no object).
std::string WriteParameters(const RobotDescription& robot, const std::string& origin);

}  // namespace dexcheck
