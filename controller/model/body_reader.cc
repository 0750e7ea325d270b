#include "controller/model/body_reader.h"

#include <cmath>

#include "controller/model/body_frame.h"

namespace dexcheck {
namespace {

// Axes are unit vectors to about the digits that people write: 0.7071.
constexpr double kUnitVectorAllowance = 1e-4;

Matrix3d ReadRotation(TomlTable& table) {
  const Vector3d rpy = table.FindAngles<3>("rpy").value_or(Vector3d::Zero());
  return (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

Vector3d ReadPoint(TomlTable& table, std::string_view key) {
  const std::optional<TomlValue> point = table.Find(key);
  return point ? point->AsVector<3>() : Vector3d::Zero();
}

/// Where a link's shape stands: `center`, and `axis` for a body of revolution or `rpy`.
Pose ReadShapePose(TomlTable& table, const Shape& shape) {
  Pose X_BS = Pose::Identity();
  X_BS.translation() = ReadPoint(table, "center");
  if (std::holds_alternative<SolidSphere>(shape)) return X_BS;
  table.RejectTogether("axis", {"rpy", "rpy_deg"});
  const std::optional<TomlValue> axis =
      std::holds_alternative<SolidBox>(shape) ? std::nullopt : table.Find("axis");
  X_BS.linear() = axis ? MakeRotationFromZ(ReadAxis(*axis)) : ReadRotation(table);
  return X_BS;
}

MassProperties ReadSolid(const TomlValue& value) {
  TomlTable table = value.AsTable();
  const Shape shape = ReadShape(table);
  const double mass = table.Get("mass").AsNotNegative();
  MassProperties solid = CalcMassProperties(shape, mass, ReadShapePose(table, shape));
  table.RejectUnused();
  return solid;
}

/// Links of published robots break the triangle inequality; their dynamics are well defined.
void CheckLink(const TomlValue& value, const MassProperties& body) {
  const std::string problem = FindUndefinedDynamics(body);
  if (!problem.empty()) value.Reject(problem);
}

/// An entry of `bodies`: its frame stands at `xyz`, `rpy` in the link's frame.
MassProperties ReadPart(const TomlValue& value) {
  TomlTable table = value.AsTable();
  const Pose X_LB = ReadPose(table);
  const std::optional<TomlValue> com = table.Find("com");
  const TomlValue inertia = table.Get("inertia");
  const MassProperties body{table.Get("mass").AsNotNegative(),
                            com ? com->AsVector<3>() : Vector3d(Vector3d::Zero()), ReadInertia(inertia)};
  CheckLink(inertia, body);
  table.RejectUnused();
  return ExpressIn(body, X_LB);
}

SolidTorus ReadTorus(TomlTable& table) {
  const SolidTorus torus{table.Get("ring_radius").AsPositive(), table.Get("tube_radius").AsPositive()};
  if (torus.tube_radius >= torus.ring_radius) {
    table.Get("tube_radius").Fail("must be less than ring_radius");
  }
  return torus;
}

SolidBox ReadBox(TomlTable& table) {
  const TomlValue size = table.Get("size");
  SolidBox box{size.AsVector<3>()};
  if (box.size.minCoeff() <= 0.0) size.Fail("must be positive");
  return box;
}

SolidEllipsoid ReadEllipsoid(TomlTable& table) {
  const TomlValue axes = table.Get("semi_axes");
  SolidEllipsoid ellipsoid{axes.AsVector<3>()};
  if (ellipsoid.semi_axes.minCoeff() <= 0.0) axes.Fail("must be positive");
  return ellipsoid;
}

}  // namespace

Vector3d ReadAxis(const TomlValue& value) {
  if (value.IsText()) {
    return Vector3d::Unit(value.AsChoice<Eigen::Index>({{"x", 0}, {"y", 1}, {"z", 2}}));
  }
  const Vector3d axis = value.AsVector<3>();
  if (!(std::abs(axis.stableNorm() - 1.0) <= kUnitVectorAllowance)) value.Fail("must be a unit vector");
  return axis.normalized();
}

Pose ReadPose(TomlTable& table) {
  Pose X = Pose::Identity();
  X.translation() = ReadPoint(table, "xyz");
  X.linear() = ReadRotation(table);
  return X;
}

Pose ReadPose(const TomlValue& value) {
  TomlTable table = value.AsTable();
  Pose X = ReadPose(table);
  table.RejectUnused();
  return X;
}

Shape ReadShape(TomlTable& table) {
  enum class Kind { kSphere, kCylinder, kCapsule, kBox, kTorus, kEllipsoid };
  switch (table.Get("shape").AsChoice<Kind>({{"sphere", Kind::kSphere},
                                             {"cylinder", Kind::kCylinder},
                                             {"capsule", Kind::kCapsule},
                                             {"box", Kind::kBox},
                                             {"torus", Kind::kTorus},
                                             {"ellipsoid", Kind::kEllipsoid}})) {
    case Kind::kCylinder:
      return SolidCylinder{table.Get("radius").AsPositive(), table.Get("length").AsPositive()};
    case Kind::kCapsule:
      return SolidCapsule{table.Get("radius").AsPositive(), table.Get("length").AsPositive()};
    case Kind::kBox:
      return ReadBox(table);
    case Kind::kTorus:
      return ReadTorus(table);
    case Kind::kEllipsoid:
      return ReadEllipsoid(table);
    case Kind::kSphere:
      break;
  }
  return SolidSphere{table.Get("radius").AsPositive()};
}

Matrix3d ReadInertia(const TomlValue& value) {
  const Vector6d I = value.AsVector<6>();
  return MakeTensor({I[0], I[1], I[2], I[3], I[4], I[5]});
}

MassProperties ReadBody(TomlTable& table) {
  table.RejectTogether("shapes", {"mass", "com", "inertia", "bodies"});
  table.RejectTogether("bodies", {"mass", "com", "inertia"});
  if (const std::optional<TomlValue> bodies = table.Find("bodies")) {
    std::vector<MassProperties> parts;
    for (const TomlValue& body : bodies->AsList()) parts.push_back(ReadPart(body));
    return Combine(parts);
  }
  if (const std::optional<TomlValue> shapes = table.Find("shapes")) {
    std::vector<MassProperties> parts;
    for (const TomlValue& shape : shapes->AsList()) parts.push_back(ReadSolid(shape));
    MassProperties body = Combine(parts);
    CheckBody(*shapes, body);
    return body;
  }
  const TomlValue inertia = table.Get("inertia");
  MassProperties body{table.Get("mass").AsNotNegative(), table.Get("com").AsVector<3>(),
                      ReadInertia(inertia)};
  CheckLink(inertia, body);
  return body;
}

void CheckBody(const TomlValue& value, const MassProperties& body) {
  const std::string problem = FindPhysicalInconsistency(body);
  if (!problem.empty()) value.Reject(problem);
}

}  // namespace dexcheck
