#pragma once

// Desired trajectories X_d(t) of the object for (55). Every trajectory starts at X_start (6: m, rad) at t = 0
// and may be evaluated at any t; before 0 it continues as its formula says. Evaluation does not allocate.

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "controller/common/toml_reader.h"
#include "controller/common/types.h"

namespace dexcheck {

// Desired motion of the object at one instant: in X_o, as the paper has it, and as a pose.

/// X_d of (55) and its derivatives: [position in the world, m; ZYZ angles, rad].
struct DesiredMotion {
  Vector6d X_d = Vector6d::Zero();
  Vector6d X_d_dot = Vector6d::Zero();
  Vector6d X_d_ddot = Vector6d::Zero();
};

/// Desired pose and its derivatives without angles: frame d relative to the world B.
struct DesiredPose {
  Vector3d p_Bd, p_Bd_dot, p_Bd_ddot;  ///< m, m/s, m/s^2, in the world.
  Matrix3d R_Bd;
  Vector3d omega_d, omega_d_dot;  ///< Body angular velocity and acceleration, axes of d, rad/s, rad/s^2.
};

/// The pose that X_d means; regular at every X_d.
DesiredPose CalcDesiredPose(const DesiredMotion& desired);

/// A function of time and its first two derivatives.
struct ScalarMotion {
  double s = 0.0, s_dot = 0.0, s_ddot = 0.0;
};

/// From 0 to 1 in `duration` s with least jerk: s = 10 u^3 - 15 u^4 + 6 u^5, u = t / duration; constant
/// outside.
ScalarMotion CalcMinJerk(double t, double duration);

/// Minimum-snap motion: s = 35 u^4 - 84 u^5 + 70 u^6 - 20 u^7. Its jerk does not jump at the ends either:
/// that would make soft contacts vibrate.
ScalarMotion CalcMinSnap(double t, double duration);

/// Motion whose speed rises from 0 to 1 in `duration` s like CalcMinJerk and stays there; s(0) = 0. Without
/// duration s = t.
ScalarMotion CalcSpeedRamp(double t, double duration);

/// X_d(t) of (55).
class Trajectory {
 public:
  virtual ~Trajectory() = default;
  /// X_d, X_d_dot, X_d_ddot at t, s.
  [[nodiscard]] virtual DesiredMotion Evaluate(double t) const = 0;

 protected:
  Trajectory() = default;
  Trajectory(const Trajectory&) = default;
  Trajectory& operator=(const Trajectory&) = default;
};

/// X_start + velocity s(t). With ramp_time = 0 the trajectory of section 6, X_start + velocity t: at full
/// speed from t = 0, whether the robot moves along then or is still at rest.
/// @param velocity per s, m/s and rad/s. @throws std::invalid_argument unless ramp_time >= 0 (s).
std::unique_ptr<Trajectory> MakeLineTrajectory(const Vector6d& X_start, const Vector6d& velocity,
                                               double ramp_time);

/// X_start to X_start + displacement with least jerk, then at rest there: moves, and rolling reorientations.
/// @throws std::invalid_argument unless duration > 0 (s).
std::unique_ptr<Trajectory> MakePointToPointTrajectory(const Vector6d& X_start, const Vector6d& displacement,
                                                       double duration);

/// X_start + amplitude sin(2 pi frequency t), the amplitude growing with least jerk over ramp_time, and
/// going again until end_time, from when on it is at rest; 0 for never.
/// @throws std::invalid_argument unless frequency > 0 (1/s), ramp_time >= 0 (s), and end_time 0 or two ramps.
std::unique_ptr<Trajectory> MakeOscillationTrajectory(const Vector6d& X_start, const Vector6d& amplitude,
                                                      double frequency, double ramp_time,
                                                      double end_time = 0.0);

/// A path in a horizontal plane that the object follows with its heading: it turns about the world's z
/// (alpha) like the path's tangent. It starts in the `heading` (rad, against the world's x) and has the speed
/// CalcSpeedRamp in its parameter.
struct PlanarPath {
  double heading = 0.0;    ///< rad
  double speed = 0.0;      ///< m/s
  double ramp_time = 0.0;  ///< s, >= 0
};
/// y = amplitude (1 - cos(2 pi x / wavelength)): weaves to one side of the line along the heading, along
/// which the speed is. @param amplitude, wavelength m. @throws std::invalid_argument unless wavelength > 0
/// and ramp_time >= 0.
std::unique_ptr<Trajectory> MakeWeaveTrajectory(const Vector6d& X_start, const PlanarPath& path,
                                                double amplitude, double wavelength);
/// Circle of the given radius (m), turning left; a negative radius turns right. The speed is along the
/// circle.
/// @throws std::invalid_argument when radius is 0 or ramp_time < 0.
std::unique_ptr<Trajectory> MakeCircleTrajectory(const Vector6d& X_start, const PlanarPath& path,
                                                 double radius);

/// X_start + displacement at a time.
struct WayPoint {
  double time;  ///< s, > 0.
  Vector6d displacement;
};

/// Through all way-points with continuous X_d_ddot: quintic pieces with the knots' velocities and
/// accelerations of the clamped cubic spline, at rest without acceleration at both ends and outside. The
/// first knot is X_start at t = 0.
/// @throws std::invalid_argument without points, or unless their times are positive and grow.
std::unique_ptr<Trajectory> MakeWayPointTrajectory(const Vector6d& X_start,
                                                   const std::vector<WayPoint>& points);

/// X_start + the displacements of all parts. Coordinates add: with a planar path a displacement of beta
/// tilts the object about a horizontal axis that turns with the path.
/// @param parts each with X_start = 0. @throws std::invalid_argument without parts.
std::unique_ptr<Trajectory> MakeSumTrajectory(const Vector6d& X_start,
                                              std::vector<std::unique_ptr<Trajectory>> parts);

/// [linear under one key; angles under another, rad or degrees], 0 where a key is missing.
Vector6d ReadCoordinates(TomlTable& table, std::string_view linear, const std::string& angular);

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
