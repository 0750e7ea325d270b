#include "controller/control/trajectory.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "controller/common/errors.h"
#include "controller/object/so3.h"

namespace dexcheck {

DesiredPose CalcDesiredPose(const DesiredMotion& desired) {
  // V = P^-1 X_dot,  V_dot = P^-1 X_ddot + d/dt(P^-1) X_dot
  const Matrix6d P_inv = CalcPInverse(desired.X_d);
  const Matrix6d P_inv_dot = CalcPInverseDot(desired.X_d, desired.X_d_dot);
  DesiredPose pose;
  pose.p_Bd = desired.X_d.head<3>();
  pose.p_Bd_dot = desired.X_d_dot.head<3>();
  pose.p_Bd_ddot = desired.X_d_ddot.head<3>();
  pose.R_Bd = CalcRotationZyz(desired.X_d.tail<3>());
  pose.omega_d = (P_inv * desired.X_d_dot).tail<3>();
  pose.omega_d_dot = (P_inv * desired.X_d_ddot + P_inv_dot * desired.X_d_dot).tail<3>();
  return pose;
}

namespace {

// X_start + direction s(t)
DesiredMotion MoveAlong(const Vector6d& X_start, const Vector6d& direction, const ScalarMotion& motion) {
  return {X_start + motion.s * direction, motion.s_dot * direction, motion.s_ddot * direction};
}

/// X_d(t) as a function.
template <typename Function>
class FunctionTrajectory final : public Trajectory {
 public:
  explicit FunctionTrajectory(Function function) : function_(std::move(function)) {}
  [[nodiscard]] DesiredMotion Evaluate(double t) const override { return function_(t); }

 private:
  Function function_;
};

template <typename Function>
std::unique_ptr<Trajectory> MakeTrajectory(Function function) {
  return std::make_unique<FunctionTrajectory<Function>>(std::move(function));
}

/// Place [x, y, turn] of a planar path at its parameter s (m), and its first two derivatives by s; x along
/// the heading.
struct PathPoint {
  Vector3d place, place_s, place_ss;
};

/// @param evaluate PathPoint of s.
template <typename Function>
std::unique_ptr<Trajectory> MakePlanarTrajectory(const Vector6d& X_start, const PlanarPath& path,
                                                 Function evaluate) {
  RequireNotNegative(path.ramp_time, "ramp_time");
  const double cos_heading = std::cos(path.heading);
  const double sin_heading = std::sin(path.heading);
  return MakeTrajectory([=](double t) -> DesiredMotion {
    const ScalarMotion motion = CalcSpeedRamp(t, path.ramp_time);
    const PathPoint at = evaluate(path.speed * motion.s);
    // X_dot = X_s s_dot, X_ddot = X_ss s_dot^2 + X_s s_ddot
    const double s_dot = path.speed * motion.s_dot;
    const Vector3d rate = at.place_s * s_dot;
    const Vector3d acceleration = at.place_ss * (s_dot * s_dot) + at.place_s * (path.speed * motion.s_ddot);
    const auto place_in_world = [&](const Vector3d& p) {
      Vector6d X = Vector6d::Zero();
      X[0] = cos_heading * p.x() - sin_heading * p.y();
      X[1] = sin_heading * p.x() + cos_heading * p.y();
      X[3] = p.z();
      return X;
    };
    return {X_start + place_in_world(at.place), place_in_world(rate), place_in_world(acceleration)};
  });
}

struct Knot {
  double time;
  Vector6d X, X_dot, X_ddot;
};

void SetKnotRates(std::vector<Knot>* all) {
  std::vector<Knot>& knots = *all;
  // Clamped cubic spline: v_{i-1} / h_i + 2 (1/h_i + 1/h_{i+1}) v_i + v_{i+1} / h_{i+1}
  //   = 3 (X_i - X_{i-1}) / h_i^2 + 3 (X_{i+1} - X_i) / h_{i+1}^2, v = 0 at the ends; by elimination.
  const size_t last = knots.size() - 1;
  std::vector<double> upper(knots.size(), 0.0);
  for (size_t i = 1; i < last; ++i) {
    Knot& knot = knots[i];
    const Knot& before = knots[i - 1];
    const Knot& after = knots[i + 1];
    const double a = 1.0 / (knot.time - before.time);
    const double b = 1.0 / (after.time - knot.time);
    const double pivot = 2.0 * (a + b) - a * upper[i - 1];
    upper[i] = b / pivot;
    knot.X_dot =
        (3.0 * a * a * (knot.X - before.X) + 3.0 * b * b * (after.X - knot.X) - a * before.X_dot) / pivot;
  }
  for (size_t i = last; i-- > 1;) knots[i].X_dot -= upper[i] * knots[i + 1].X_dot;
  // X_ddot_i = 6 (X_{i+1} - X_i) / h^2 - (4 v_i + 2 v_{i+1}) / h
  for (size_t i = 1; i < last; ++i) {
    const double b = 1.0 / (knots[i + 1].time - knots[i].time);
    knots[i].X_ddot =
        6.0 * b * b * (knots[i + 1].X - knots[i].X) - b * (4.0 * knots[i].X_dot + 2.0 * knots[i + 1].X_dot);
  }
}

DesiredMotion EvaluateKnots(const std::vector<Knot>& knots, double t) {
  if (t <= knots.front().time) return {knots.front().X, Vector6d::Zero(), Vector6d::Zero()};
  if (t >= knots.back().time) return {knots.back().X, Vector6d::Zero(), Vector6d::Zero()};
  const auto after = std::upper_bound(knots.begin(), knots.end(), t,
                                      [](double time, const Knot& k) { return time < k.time; });
  const Knot& k1 = *after;
  const Knot& k0 = *(after - 1);
  const double h = k1.time - k0.time;
  const double u = (t - k0.time) / h;
  // The quintic with value, velocity and acceleration of both knots: X_0 + v_0 t + a_0 t^2/2 up to second
  // order, and what is missing at the end, in value, velocity, acceleration, through u^3, u^4, u^5.
  const Vector6d v0 = h * k0.X_dot;
  const Vector6d a0 = h * h * k0.X_ddot;
  const Vector6d d = k1.X - k0.X - v0 - 0.5 * a0;
  const Vector6d e = h * k1.X_dot - v0 - a0;
  const Vector6d f = h * h * k1.X_ddot - a0;
  const Vector6d c3 = 10.0 * d - 4.0 * e + 0.5 * f;
  const Vector6d c4 = -15.0 * d + 7.0 * e - f;
  const Vector6d c5 = 6.0 * d - 3.0 * e + 0.5 * f;
  DesiredMotion motion;
  motion.X_d = k0.X + u * (v0 + u * (0.5 * a0 + u * (c3 + u * (c4 + u * c5))));
  motion.X_d_dot = (v0 + u * (a0 + u * (3.0 * c3 + u * (4.0 * c4 + u * (5.0 * c5))))) / h;
  motion.X_d_ddot = (a0 + u * (6.0 * c3 + u * (12.0 * c4 + u * (20.0 * c5)))) / (h * h);
  return motion;
}

double ReadRampTime(TomlTable& table) {
  return table.Find("ramp_time", &TomlValue::AsNotNegative).value_or(0.0);
}

double ReadHeading(TomlTable& table) {
  const auto [value, unit] = table.FindWithAngleUnit("heading");
  return value ? unit * value->AsNumber() : 0.0;
}

// The square of the rate 2 pi f must not overflow: the acceleration has it.
double ReadFrequency(TomlTable& table) {
  const TomlValue frequency = table.Get("frequency");
  const double rate = 2.0 * kPi * frequency.AsPositive();
  if (!std::isfinite(rate * rate)) frequency.Fail("must not be so large");
  return frequency.AsPositive();
}

struct Wave {
  double amplitude;
  double wavelength;
};

// Nor must the curvature at the crests, amplitude k^2 with k = 2 pi / wavelength.
Wave ReadWave(TomlTable& table) {
  const TomlValue amplitude = table.Get("amplitude");
  const TomlValue wavelength = table.Get("wavelength");
  const double k = 2.0 * kPi / wavelength.AsPositive();
  if (!std::isfinite(k * k)) wavelength.Fail("must not be so small");
  if (!std::isfinite(amplitude.AsNumber() * k * k)) amplitude.Fail("must not be so large");
  return {amplitude.AsNumber(), wavelength.AsPositive()};
}

std::vector<WayPoint> ReadWayPoints(TomlTable& table) {
  std::vector<WayPoint> points;
  const TomlValue list = table.Get("points");
  for (const TomlValue& entry : list.AsList()) {
    TomlTable point = entry.AsTable();
    const TomlValue time = point.Get("time");
    if (time.AsPositive() <= (points.empty() ? 0.0 : points.back().time)) {
      time.Fail("must be greater than the time before");
    }
    points.push_back({time.AsPositive(), ReadCoordinates(point, "xyz", "zyz")});
    point.RejectUnused();
  }
  if (points.empty()) list.Reject("needs at least one point");
  return points;
}

std::vector<TrajectoryMaker> ReadParts(TomlTable& table) {
  std::vector<TrajectoryMaker> parts;
  const TomlValue list = table.Get("parts");
  for (const TomlValue& entry : list.AsList()) {
    TomlTable part = entry.AsTable();
    parts.push_back(ReadTrajectory(part));
  }
  if (parts.empty()) list.Reject("needs at least one part");
  return parts;
}

/// The maker by a function that takes the start and then these arguments.
template <typename Make, typename... Arguments>
TrajectoryMaker MakerOf(const Make& make, const Arguments&... arguments) {
  return [=](const Vector6d& X_start) { return make(X_start, arguments...); };
}

std::unique_ptr<Trajectory> MakeSum(const Vector6d& X_start, const std::vector<TrajectoryMaker>& parts) {
  std::vector<std::unique_ptr<Trajectory>> made;
  for (const TrajectoryMaker& part : parts) made.push_back(part(Vector6d::Zero()));
  return MakeSumTrajectory(X_start, std::move(made));
}

PlanarPath ReadPath(TomlTable& table) {
  const double heading = ReadHeading(table);
  const double speed = table.Get("speed").AsNumber();
  return {heading, speed, ReadRampTime(table)};
}

TrajectoryMaker ReadByType(TomlTable& table) {
  using Read = TrajectoryMaker (*)(TomlTable&);
  const auto read = table.Get("type").AsChoice<Read>(
      {{"line",
        [](TomlTable& t) {
          const Vector6d velocity = ReadCoordinates(t, "velocity", "turning");
          return MakerOf(MakeLineTrajectory, velocity, ReadRampTime(t));
        }},
       {"point_to_point",
        [](TomlTable& t) {
          const Vector6d displacement = ReadCoordinates(t, "xyz", "zyz");
          return MakerOf(MakePointToPointTrajectory, displacement, t.Get("duration").AsPositive());
        }},
       {"oscillation",
        [](TomlTable& t) {
          const Vector6d amplitude = ReadCoordinates(t, "xyz", "zyz");
          const double frequency = ReadFrequency(t);
          return MakerOf(MakeOscillationTrajectory, amplitude, frequency, ReadRampTime(t), 0.0);
        }},
       {"weave",
        [](TomlTable& t) {
          const Wave wave = ReadWave(t);
          return MakerOf(MakeWeaveTrajectory, ReadPath(t), wave.amplitude, wave.wavelength);
        }},
       {"circle",
        [](TomlTable& t) {
          const TomlValue radius = t.Get("radius");
          if (radius.AsNumber() == 0.0) radius.Fail("must not be zero");
          return MakerOf(MakeCircleTrajectory, ReadPath(t), radius.AsNumber());
        }},
       {"way_points", [](TomlTable& t) { return MakerOf(MakeWayPointTrajectory, ReadWayPoints(t)); }},
       {"sum", [](TomlTable& t) { return MakerOf(MakeSum, ReadParts(t)); }}});
  return read(table);
}

}  // namespace

ScalarMotion CalcMinJerk(double t, double duration) {
  if (t <= 0.0) return {};
  if (t >= duration) return {1.0, 0.0, 0.0};
  const double u = t / duration;
  return {u * u * u * (10.0 + u * (-15.0 + 6.0 * u)), 30.0 * u * u * (1.0 - u) * (1.0 - u) / duration,
          60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (duration * duration)};
}

ScalarMotion CalcMinSnap(double t, double duration) {
  if (t <= 0.0) return {};
  if (t >= duration) return {1.0, 0.0, 0.0};
  const double u = t / duration;
  const double v = 1.0 - u;
  return {u * u * u * u * (35.0 + u * (-84.0 + u * (70.0 - 20.0 * u))),
          140.0 * u * u * u * v * v * v / duration,
          420.0 * u * u * v * v * (1.0 - 2.0 * u) / (duration * duration)};
}

ScalarMotion CalcSpeedRamp(double t, double duration) {
  if (duration <= 0.0) return {t, 1.0, 0.0};
  if (t <= 0.0) return {};
  if (t >= duration) return {t - duration / 2.0, 1.0, 0.0};
  // integral of the least-jerk step: duration (5/2 u^4 - 3 u^5 + u^6)
  const ScalarMotion speed = CalcMinJerk(t, duration);
  const double u = t / duration;
  return {duration * u * u * u * u * (2.5 + u * (-3.0 + u)), speed.s, speed.s_dot};
}

std::unique_ptr<Trajectory> MakeLineTrajectory(const Vector6d& X_start, const Vector6d& velocity,
                                               double ramp_time) {
  RequireNotNegative(ramp_time, "ramp_time");
  return MakeTrajectory([=](double t) { return MoveAlong(X_start, velocity, CalcSpeedRamp(t, ramp_time)); });
}

std::unique_ptr<Trajectory> MakePointToPointTrajectory(const Vector6d& X_start, const Vector6d& displacement,
                                                       double duration) {
  Require(duration > 0.0, "duration", "must be positive", duration);
  return MakeTrajectory([=](double t) { return MoveAlong(X_start, displacement, CalcMinJerk(t, duration)); });
}

std::unique_ptr<Trajectory> MakeOscillationTrajectory(const Vector6d& X_start, const Vector6d& amplitude,
                                                      double frequency, double ramp_time, double end_time) {
  RequireNotNegative(ramp_time, "ramp_time");
  Require(frequency > 0.0, "frequency", "must be positive", frequency);
  Require(end_time == 0.0 || end_time >= 2.0 * ramp_time, "end_time", "must be 0 or two ramps", end_time);
  return MakeTrajectory([=, rate = 2.0 * kPi * frequency](double t) {
    ScalarMotion ramp = ramp_time > 0.0 ? CalcMinJerk(t, ramp_time) : ScalarMotion{1.0, 0.0, 0.0};
    if (end_time > 0.0 && t > end_time - ramp_time) {
      ramp = CalcMinJerk(end_time - t, ramp_time);
      ramp.s_dot = -ramp.s_dot;
    }
    const double sine = std::sin(rate * t);
    const double cosine = std::cos(rate * t);
    return MoveAlong(X_start, amplitude,
                     {ramp.s * sine, ramp.s_dot * sine + ramp.s * rate * cosine,
                      ramp.s_ddot * sine + 2.0 * ramp.s_dot * rate * cosine - ramp.s * rate * rate * sine});
  });
}

std::unique_ptr<Trajectory> MakeWeaveTrajectory(const Vector6d& X_start, const PlanarPath& path,
                                                double amplitude, double wavelength) {
  Require(wavelength > 0.0, "wavelength", "must be positive", wavelength);
  return MakePlanarTrajectory(X_start, path, [=, k = 2.0 * kPi / wavelength](double s) -> PathPoint {
    const double c = std::cos(k * s);
    // y' = slope; turn = atan(slope)
    const double slope = amplitude * k * std::sin(k * s);
    const double slope_s = amplitude * k * k * c;
    const double slope_ss = -k * k * slope;
    const double secant = 1.0 / (1.0 + slope * slope);
    return {{s, amplitude * (1.0 - c), std::atan(slope)},
            {1.0, slope, slope_s * secant},
            {0.0, slope_s, slope_ss * secant - 2.0 * slope * slope_s * slope_s * secant * secant}};
  });
}

std::unique_ptr<Trajectory> MakeCircleTrajectory(const Vector6d& X_start, const PlanarPath& path,
                                                 double radius) {
  Require(radius != 0.0, "radius", "must not be zero", radius);
  return MakePlanarTrajectory(X_start, path, [=](double s) -> PathPoint {
    const double turn = s / radius;
    const double c = std::cos(turn);
    const double n = std::sin(turn);
    return {{radius * n, radius * (1.0 - c), turn}, {c, n, 1.0 / radius}, {-n / radius, c / radius, 0.0}};
  });
}

std::unique_ptr<Trajectory> MakeWayPointTrajectory(const Vector6d& X_start,
                                                   const std::vector<WayPoint>& points) {
  Require(!points.empty(), "number of way-points", "must be positive", 0.0);
  std::vector<Knot> knots = {{0.0, X_start, Vector6d::Zero(), Vector6d::Zero()}};
  for (const WayPoint& point : points) {
    Require(point.time > knots.back().time, "time of way-point",
            "must be positive and greater than the one before", point.time);
    knots.push_back({point.time, X_start + point.displacement, Vector6d::Zero(), Vector6d::Zero()});
  }
  SetKnotRates(&knots);
  return MakeTrajectory([knots = std::move(knots)](double t) { return EvaluateKnots(knots, t); });
}

std::unique_ptr<Trajectory> MakeSumTrajectory(const Vector6d& X_start,
                                              std::vector<std::unique_ptr<Trajectory>> parts) {
  Require(!parts.empty(), "number of parts", "must be positive", 0.0);
  return MakeTrajectory([X_start, parts = std::move(parts)](double t) {
    DesiredMotion sum{X_start, Vector6d::Zero(), Vector6d::Zero()};
    for (const std::unique_ptr<Trajectory>& part : parts) {
      const DesiredMotion motion = part->Evaluate(t);
      sum.X_d += motion.X_d;
      sum.X_d_dot += motion.X_d_dot;
      sum.X_d_ddot += motion.X_d_ddot;
    }
    return sum;
  });
}

Vector6d ReadCoordinates(TomlTable& table, std::string_view linear, const std::string& angular) {
  Vector6d X = Vector6d::Zero();
  if (const auto value = table.Find(linear)) X.head<3>() = value->AsVector<3>();
  if (const auto angles = table.FindAngles<3>(angular)) X.tail<3>() = *angles;
  return X;
}

TrajectoryMaker ReadTrajectory(TomlTable& table) {
  TrajectoryMaker maker = ReadByType(table);
  table.RejectUnused();
  return maker;
}

}  // namespace dexcheck
