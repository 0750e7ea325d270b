#pragma once

// Poses, shapes and mass properties as they stand in a parameter file. All throw InputError.

#include "controller/common/toml_reader.h"
#include "controller/common/types.h"
#include "controller/model/rigid_body.h"

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

}  // namespace dexcheck
