#pragma once

#include <memory>

#include "controller/common/toml_reader.h"
#include "controller/control/trajectory.h"

namespace dexcheck {

/// Reads a trajectory that starts at X_start from a table. Keys by `type`; SI units, angles also as KEY_deg:
///
///   line            velocity = [3], turning = [3] (rates of the ZYZ angles), ramp_time
///   point_to_point  xyz = [3], zyz = [3], duration
///   oscillation     xyz = [3], zyz = [3], frequency, ramp_time
///   weave           heading, speed, ramp_time, amplitude, wavelength
///   circle          heading, speed, ramp_time, radius
///   way_points      points = [{ time, xyz = [3], zyz = [3] }, ..]
///   sum             parts = [{ type, .. }, ..], whose displacements add
///
/// xyz and zyz are displacements or amplitudes against X_start. Optional: velocity, turning, xyz, zyz,
/// heading and ramp_time, 0 unless given.
/// @throws InputError, one line that names file, line, key and value.
std::unique_ptr<Trajectory> ReadTrajectory(TomlTable& table, const Vector6d& X_start);

}  // namespace dexcheck
