#pragma once

// Poses, shapes and mass properties as they stand in a parameter file. All throw InputError.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/toml_reader.h"
#include "controller/common/types.h"
#include "controller/model/parameter_reader.h"
#include "controller/model/rigid_body.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// Pose from the keys xyz (m) and rpy or rpy_deg, both optional: R = Rz(yaw) Ry(pitch) Rx(roll).
Pose ReadPose(TomlTable& table);

/// Pose from a table of its own.
Pose ReadPose(const TomlValue& value);

/// Shape from the key `shape` and the dimensions that belong to it, m.
Shape ReadShape(TomlTable& table);

/// Inertia about the centre of mass from a list [Ixx, Iyy, Izz, Ixy, Ixz, Iyz] of tensor entries, kg m^2.
Matrix3d ReadInertia(const TomlValue& value);

/// Unit vector from "x", "y", "z" or a list of three numbers.
Vector3d ReadAxis(const TomlValue& value);

/// Mass properties from the key `shapes`, or from `bodies` with a frame each, or from `mass`, `com` and
/// `inertia`; physically consistent.
MassProperties ReadBody(TomlTable& table);

/// Throws at `value` when the body cannot be real.
void CheckBody(const TomlValue& value, const MassProperties& body);

// A run of joints as it stands in a parameter file, in a chain or in a template: names without prefix.

/// A row of a table of joints, with the names of the joint and of the link that it moves. It is a row of MDH
/// parameters, of classic Denavit-Hartenberg parameters, or a plain transform with an axis. A ball joint's
/// row is a plain transform.
struct SegmentRow {
  TomlValue value;
  std::string joint;
  std::string link;
  JointType type;
  MdhRow mdh;     ///< Of frame i; zeros for a plain transform.
  Pose X_before;  ///< Comes before the MDH row: a plain transform and the turn of z to its axis.
  WrittenRow written;
};

/// The joint that another one follows: q = multiplier q_leader + offset.
struct MimicEntry {
  TomlValue joint;
  double multiplier;
  double offset;  ///< rad or m
};

/// An entry of `joints`.
struct JointEntry {
  TomlValue value;
  TomlValue range;
  bool range_is_angle;                 ///< Given in degrees, so the joint must be revolute.
  double lower;                        ///< rad or m
  double upper;                        ///< rad or m
  std::optional<double> damping;       ///< N m s/rad or N s/m
  std::optional<double> armature;      ///< kg m^2 or kg
  std::optional<double> dry_friction;  ///< N m or N
  std::optional<MimicEntry> mimic;
  bool used = false;  ///< A row of this name was found.
};

/// An entry of `links`.
struct LinkEntry {
  TomlValue value;
  MassProperties body;
  bool used = false;  ///< A row with a link of this name was found.
};

/// An entry of `frames`, or of the file's `frame`.
struct FrameEntry {
  TomlValue value;
  TomlValue name;
  TomlValue link;
  Pose X_LF;
  std::optional<double> sphere_radius;
};

struct Segment {
  std::vector<SegmentRow> rows;
  std::map<std::string, JointEntry> joints;
  std::map<std::string, LinkEntry> links;
  std::vector<FrameEntry> frames;
};

/// Reads `rows`, `joints`, `links` and `frames`, each of which may be missing. @throws InputError.
Segment ReadSegment(TomlTable& table);

/// Reads a frame. @throws InputError.
FrameEntry ReadFrameEntry(const TomlValue& value);

/// Most joints, and most frames, that a file may describe: templates make it easy to describe millions.
inline constexpr size_t kMaxJoints = 1000;

/// Reads the keys `chain`, `template` and `frame` of a parameter file into the specification's joints and
/// frames. Its base must have been read. @return the rows as they are written, by joint. @throws InputError.
std::vector<WrittenRow> ReadTree(TomlTable& root, RobotSpec& spec);

}  // namespace dexcheck
