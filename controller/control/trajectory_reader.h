#pragma once

#include <functional>
#include <memory>

#include "controller/common/toml_reader.h"
#include "controller/control/trajectory.h"

namespace dexcheck {

/// Makes a trajectory that starts at X_start.
using TrajectoryMaker = std::function<std::unique_ptr<Trajectory>(const Vector6d& X_start)>;

/// Reads a trajectory from a table; where it starts is not in it. Keys by `type`; SI units, angles also as
/// KEY_deg:
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
TrajectoryMaker ReadTrajectory(TomlTable& table);

}  // namespace dexcheck
