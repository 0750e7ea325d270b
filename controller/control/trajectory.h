#pragma once

// Desired trajectories X_d(t) of the object for (55). Every trajectory starts at X_start (6: m, rad) at t = 0
// and may be evaluated at any t; before 0 it continues as its formula says. Evaluation does not allocate.

#include <memory>
#include <vector>

#include "controller/common/types.h"
#include "controller/control/desired_motion.h"

namespace dexcheck {

/// A function of time and its first two derivatives.
struct ScalarMotion {
  double s = 0.0;
  double s_dot = 0.0;
  double s_ddot = 0.0;
};

/// From 0 to 1 in `duration` s with least jerk: s = 10 u^3 - 15 u^4 + 6 u^5, u = t / duration; constant
/// outside.
ScalarMotion CalcMinJerk(double t, double duration);

/// The same with least snap: s = 35 u^4 - 84 u^5 + 70 u^6 - 20 u^7. Its jerk does not jump at the ends
/// either, which soft contacts answer with vibration.
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
class LineTrajectory final : public Trajectory {
 public:
  /// @param velocity per s, m/s and rad/s. @throws std::invalid_argument unless ramp_time >= 0 (s).
  LineTrajectory(const Vector6d& X_start, const Vector6d& velocity, double ramp_time);
  [[nodiscard]] DesiredMotion Evaluate(double t) const override;

 private:
  Vector6d X_start_, velocity_;
  double ramp_time_;
};

/// X_start to X_start + displacement with least jerk, then at rest there: moves, and rolling reorientations.
class PointToPointTrajectory final : public Trajectory {
 public:
  /// @throws std::invalid_argument unless duration > 0 (s).
  PointToPointTrajectory(const Vector6d& X_start, const Vector6d& displacement, double duration);
  [[nodiscard]] DesiredMotion Evaluate(double t) const override;

 private:
  Vector6d X_start_, displacement_;
  double duration_;
};

/// X_start + amplitude sin(2 pi frequency t), the amplitude growing with least jerk over ramp_time.
class OscillationTrajectory final : public Trajectory {
 public:
  /// @throws std::invalid_argument unless frequency > 0 (1/s) and ramp_time >= 0 (s).
  OscillationTrajectory(const Vector6d& X_start, const Vector6d& amplitude, double frequency,
                        double ramp_time);
  [[nodiscard]] DesiredMotion Evaluate(double t) const override;

 private:
  Vector6d X_start_, amplitude_;
  double rate_;  // rad/s
  double ramp_time_;
};

/// A path in a horizontal plane that the object follows with its heading: it turns about the world's z
/// (alpha) like the path's tangent. The path starts in the `heading` (rad, against the world's x) and has the
/// speed CalcSpeedRamp in its parameter.
class PlanarTrajectory : public Trajectory {
 public:
  /// @throws std::invalid_argument unless ramp_time >= 0 (s).
  PlanarTrajectory(const Vector6d& X_start, double heading, double speed, double ramp_time);
  [[nodiscard]] DesiredMotion Evaluate(double t) const final;

 protected:
  /// Place [x, y, turn] of the path at its parameter s (m), and its first two derivatives by s; x along the
  /// heading.
  struct PathPoint {
    Vector3d place, place_s, place_ss;
  };

 private:
  [[nodiscard]] virtual PathPoint DoEvaluate(double s) const = 0;

  Vector6d X_start_;
  double cos_heading_, sin_heading_;
  double speed_, ramp_time_;
};

/// y = amplitude (1 - cos(2 pi x / wavelength)): weaves to one side of the line along the heading.
class WeaveTrajectory final : public PlanarTrajectory {
 public:
  /// @param speed along the line, m/s. @param amplitude, wavelength m. @throws std::invalid_argument unless
  /// wavelength > 0 and ramp_time >= 0.
  WeaveTrajectory(const Vector6d& X_start, double heading, double speed, double ramp_time, double amplitude,
                  double wavelength);

 private:
  [[nodiscard]] PathPoint DoEvaluate(double s) const override;
  double amplitude_, wave_number_;
};

/// Circle of the given radius, turning left; a negative radius turns right.
class CircleTrajectory final : public PlanarTrajectory {
 public:
  /// @param speed along the circle, m/s. @throws std::invalid_argument when radius (m) is 0 or ramp_time < 0.
  CircleTrajectory(const Vector6d& X_start, double heading, double speed, double ramp_time, double radius);

 private:
  [[nodiscard]] PathPoint DoEvaluate(double s) const override;
  double radius_;
};

/// X_start + displacement at a time.
struct WayPoint {
  double time;  ///< s, > 0.
  Vector6d displacement;
};

/// Through all way-points with continuous X_d_ddot: quintic pieces with the knots' velocities and
/// accelerations of the clamped cubic spline, at rest without acceleration at both ends and outside.
class WayPointTrajectory final : public Trajectory {
 public:
  /// The first knot is X_start at t = 0.
  /// @throws std::invalid_argument without points, or unless their times are positive and grow.
  WayPointTrajectory(const Vector6d& X_start, const std::vector<WayPoint>& points);
  [[nodiscard]] DesiredMotion Evaluate(double t) const override;

 private:
  struct Knot {
    double time;
    Vector6d X, X_dot, X_ddot;
  };
  void SetKnotRates();
  std::vector<Knot> knots_;
};

/// X_start + the displacements of all parts. Coordinates add: with a planar path a displacement of beta
/// tilts the object about a horizontal axis that turns with the path.
class SumTrajectory final : public Trajectory {
 public:
  /// @param parts each with X_start = 0. @throws std::invalid_argument without parts.
  SumTrajectory(const Vector6d& X_start, std::vector<std::unique_ptr<Trajectory>> parts);
  [[nodiscard]] DesiredMotion Evaluate(double t) const override;

 private:
  Vector6d X_start_;
  std::vector<std::unique_ptr<Trajectory>> parts_;
};

}  // namespace dexcheck
