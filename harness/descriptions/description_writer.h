#pragma once

// A parameter file from a description of a robot.

#include <string>
#include <string_view>

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

// Files that the engine reads: an MJCF from a description whose user has none, and a URDF as its importer
// should read it.

/// The mechanism as an MJCF: a body for each joint's link, in frame i of that joint, with principal moments
/// to rounding; limits, damping, armature, friction and frames (as sites). It has no shapes, no couplings and
/// no actuators. What is wrong in the description is wrong in it.
/// @param origin what it was made from, for its first comment.
/// @throws InputError for a base that rolls and for ball joints.
std::string WriteMjcf(const RobotDescription& robot, const std::string& origin);

/// A URDF as the engine's own importer should read it: without looks and collision shapes, whose meshes
/// nobody needs, without inertials of what is fixed to the world, each link a body of its own (<compiler
/// fusestatic="false"/>), and the root on a floating joint when it floats.
/// @throws InputError as UrdfFile.
std::string WriteEngineUrdf(std::string_view text, const std::string& source, bool floats);

}  // namespace dexcheck
