#include "controller/control/trajectory_reader.h"

#include <cmath>
#include <utility>
#include <vector>

namespace dexcheck {
namespace {

enum class Type { kLine, kPointToPoint, kOscillation, kWeave, kCircle, kWayPoints, kSum };

// [linear under one key; angles under another, rad or degrees], 0 where a key is missing.
Vector6d ReadCoordinates(TomlTable& table, std::string_view linear, const std::string& angular) {
  Vector6d X = Vector6d::Zero();
  if (const auto value = table.Find(linear)) X.head<3>() = value->AsVector<3>();
  if (const auto angles = table.FindAngles<3>(angular)) X.tail<3>() = *angles;
  return X;
}

double ReadRampTime(TomlTable& table) {
  const auto value = table.Find("ramp_time");
  return value ? value->AsNotNegative() : 0.0;
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
  const Type type = table.Get("type").AsChoice<Type>({{"line", Type::kLine},
                                                      {"point_to_point", Type::kPointToPoint},
                                                      {"oscillation", Type::kOscillation},
                                                      {"weave", Type::kWeave},
                                                      {"circle", Type::kCircle},
                                                      {"way_points", Type::kWayPoints},
                                                      {"sum", Type::kSum}});
  switch (type) {
    case Type::kLine: {
      const Vector6d velocity = ReadCoordinates(table, "velocity", "turning");
      return MakerOf(MakeLineTrajectory, velocity, ReadRampTime(table));
    }
    case Type::kPointToPoint: {
      const Vector6d displacement = ReadCoordinates(table, "xyz", "zyz");
      return MakerOf(MakePointToPointTrajectory, displacement, table.Get("duration").AsPositive());
    }
    case Type::kOscillation: {
      const Vector6d amplitude = ReadCoordinates(table, "xyz", "zyz");
      const double frequency = ReadFrequency(table);
      return MakerOf(MakeOscillationTrajectory, amplitude, frequency, ReadRampTime(table));
    }
    case Type::kWeave: {
      const Wave wave = ReadWave(table);
      return MakerOf(MakeWeaveTrajectory, ReadPath(table), wave.amplitude, wave.wavelength);
    }
    case Type::kCircle: {
      const TomlValue radius = table.Get("radius");
      if (radius.AsNumber() == 0.0) radius.Fail("must not be zero");
      return MakerOf(MakeCircleTrajectory, ReadPath(table), radius.AsNumber());
    }
    case Type::kWayPoints:
      return MakerOf(MakeWayPointTrajectory, ReadWayPoints(table));
    case Type::kSum:
      return MakerOf(MakeSum, ReadParts(table));
  }
  return nullptr;
}

}  // namespace

TrajectoryMaker ReadTrajectory(TomlTable& table) {
  TrajectoryMaker maker = ReadByType(table);
  table.RejectUnused();
  return maker;
}

}  // namespace dexcheck
