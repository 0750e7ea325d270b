#include "controller/model/segment_reader.h"

#include <cmath>

namespace dexcheck {

namespace {

// Axes are unit vectors to about the digits that people write: 0.7071.
constexpr double kUnitVectorAllowance = 1e-4;

template <typename Entry>
std::vector<Entry> ReadList(const std::vector<TomlValue>& values, Entry (*read)(const TomlValue&)) {
  std::vector<Entry> entries;
  for (const TomlValue& value : values) entries.push_back(read(value));
  return entries;
}

Matrix3d ReadRotation(TomlTable& table) {
  return TurnRollPitchYaw(table.FindAngles<3>("rpy").value_or(Vector3d::Zero()));
}

Vector3d ReadPoint(TomlTable& table, std::string_view key) {
  return table.Find(key, &TomlValue::AsVector<3>).value_or(Vector3d::Zero());
}

/// Pose of a link's shape: `center`, and `axis` for a body of revolution or `rpy`.
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
  const Vector3d com = ReadPoint(table, "com");
  const TomlValue inertia = table.Get("inertia");
  const MassProperties body{table.Get("mass").AsNotNegative(), com, ReadInertia(inertia)};
  CheckLink(inertia, body);
  table.RejectUnused();
  return ExpressIn(body, X_LB);
}

Vector3d ReadLengths(TomlTable& table, const char* key) {
  const TomlValue lengths = table.Get(key);
  const Vector3d values = lengths.AsVector<3>();
  if (values.minCoeff() <= 0.0) lengths.Fail("must be positive");
  return values;
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
  const std::string kind = table.Get("shape").AsChoice<std::string>({{"sphere", "sphere"},
                                                                     {"cylinder", "cylinder"},
                                                                     {"capsule", "capsule"},
                                                                     {"box", "box"},
                                                                     {"torus", "torus"},
                                                                     {"ellipsoid", "ellipsoid"}});
  if (kind == "box") return SolidBox{ReadLengths(table, "size")};
  if (kind == "ellipsoid") return SolidEllipsoid{ReadLengths(table, "semi_axes")};
  if (kind == "torus") {
    const SolidTorus torus{table.Get("ring_radius").AsPositive(), table.Get("tube_radius").AsPositive()};
    if (torus.tube_radius >= torus.ring_radius)
      table.Get("tube_radius").Fail("must be less than ring_radius");
    return torus;
  }
  const double radius = table.Get("radius").AsPositive();
  if (kind == "sphere") return SolidSphere{radius};
  const double length = table.Get("length").AsPositive();
  return kind == "cylinder" ? Shape(SolidCylinder{radius, length}) : Shape(SolidCapsule{radius, length});
}

Matrix3d ReadInertia(const TomlValue& value) { return ToTensor(value.AsVector<6>()); }

MassProperties ReadBody(TomlTable& table) {
  table.RejectTogether("shapes", {"mass", "com", "inertia", "bodies"});
  table.RejectTogether("bodies", {"mass", "com", "inertia"});
  if (const std::optional<TomlValue> bodies = table.Find("bodies"))
    return Combine(ReadList(bodies->AsList(), ReadPart));
  if (const std::optional<TomlValue> shapes = table.Find("shapes")) {
    MassProperties body = Combine(ReadList(shapes->AsList(), ReadSolid));
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

namespace {

enum class Convention { kModified, kClassic };

/// Rot(z, q) Trans(z, d) Trans(x, a) Rot(x, alpha): frame i turns with the joint about its z axis, and the
/// link's own frame, whose z axis is the next joint's, stands at a and alpha in it.
void MakeClassic(SegmentRow& row) {
  row.written.X_iL =
      Eigen::Translation3d(row.mdh.a, 0.0, 0.0) * Eigen::AngleAxisd(row.mdh.alpha, Vector3d::UnitX());
  row.mdh.a = 0.0;
  row.mdh.alpha = 0.0;
}

/// X(xyz, rpy) and the joint's axis in the frame there, which is the link's own.
void ReadPlainTransform(TomlTable& table, SegmentRow& row) {
  const Pose X_PL = ReadPose(table);
  const std::optional<TomlValue> axis = table.Find("axis");
  const Vector3d z = axis ? ReadAxis(*axis) : Vector3d::UnitZ();
  row.written.is_plain = true;
  row.written.rpy = table.FindAngles<3>("rpy").value_or(Vector3d::Zero());
  row.X_before = X_PL;
  if (z == Vector3d::UnitZ()) return;
  const Matrix3d R = MakeRotationFromZ(z);
  row.X_before.linear() = X_PL.linear() * R;
  row.written.X_iL.linear() = R.transpose();
}

SegmentRow ReadRow(const TomlValue& value, Convention convention) {
  TomlTable table = value.AsTable();
  SegmentRow row{value,
                 table.Get("joint").AsPartName(),
                 table.Get("link").AsPartName(),
                 JointType::kRevolute,
                 {},
                 Pose::Identity(),
                 {}};
  if (const std::optional<TomlValue> type = table.Find("type")) {
    row.type = type->AsChoice<JointType>({{"revolute", JointType::kRevolute},
                                          {"prismatic", JointType::kPrismatic},
                                          {"ball", JointType::kBall}});
  }
  bool is_plain = false;
  for (const char* key : {"xyz", "rpy", "rpy_deg", "axis"}) {
    if (row.type == JointType::kBall) break;
    table.RejectTogether(key, {"alpha", "alpha_deg", "a", "q", "q_deg", "d"});
    is_plain = is_plain || table.Find(key);
  }
  if (row.type == JointType::kBall) {
    // It turns about all axes of the link's own frame, placed by a plain transform.
    row.X_before = ReadPose(table);
    row.written.is_plain = true;
  } else if (is_plain) {
    ReadPlainTransform(table, row);
  } else {
    row.mdh = {table.GetAngle("alpha"), table.Get("a").AsNumber(), table.GetAngle("q"),
               table.Get("d").AsNumber()};
    if (convention == Convention::kClassic) MakeClassic(row);
  }
  table.RejectUnused();
  return row;
}

std::vector<SegmentRow> ReadRows(TomlTable& table) {
  Convention convention = Convention::kModified;
  if (const std::optional<TomlValue> value = table.Find("convention")) {
    convention =
        value->AsChoice<Convention>({{"modified", Convention::kModified}, {"classic", Convention::kClassic}});
  }
  std::vector<SegmentRow> rows;
  for (const TomlValue& value : table.FindList("rows")) rows.push_back(ReadRow(value, convention));
  return rows;
}

MimicEntry ReadMimic(const TomlValue& value) {
  TomlTable table = value.AsTable();
  const double multiplier = table.Find("multiplier", &TomlValue::AsNumber).value_or(1.0);
  const double offset = table.Find("offset", &TomlValue::AsNumber).value_or(0.0);
  MimicEntry entry{table.Get("joint"), multiplier, offset};
  table.RejectUnused();
  return entry;
}

JointEntry ReadJointEntry(const TomlValue& value) {
  TomlTable table = value.AsTable();
  auto [range, unit] = table.FindWithAngleUnit("range");
  if (!range) range = table.Miss("range");
  const Vector2d limits = unit * range->AsVector<2>();
  if (limits[0] > limits[1]) range->Fail("lower limit must not exceed upper limit");
  const auto find = [&](const char* key) { return table.Find(key, &TomlValue::AsNotNegative); };
  const std::optional<TomlValue> mimic = table.Find("mimic");
  JointEntry entry{value,
                   *range,
                   unit != 1.0,
                   limits[0],
                   limits[1],
                   find("damping"),
                   find("armature"),
                   find("dry_friction"),
                   mimic ? std::optional(ReadMimic(*mimic)) : std::nullopt};
  table.RejectUnused();
  return entry;
}

LinkEntry ReadLinkEntry(const TomlValue& value) {
  TomlTable table = value.AsTable();
  LinkEntry entry{value, ReadBody(table)};
  table.RejectUnused();
  return entry;
}

/// A table of named entries.
template <typename Entry>
std::map<std::string, Entry> ReadEntries(const std::optional<TomlValue>& value,
                                         Entry (*read)(const TomlValue&)) {
  std::map<std::string, Entry> entries;
  if (!value) return entries;
  TomlTable table = value->AsTable();
  for (const auto& [name, entry] : table.GetEntries()) entries.emplace(name, read(entry));
  return entries;
}

}  // namespace

FrameEntry ReadFrameEntry(const TomlValue& value) {
  TomlTable table = value.AsTable();
  FrameEntry frame{value, table.Get("name"), table.Get("link"), ReadPose(table),
                   table.Find("sphere_radius", &TomlValue::AsPositive)};
  table.RejectUnused();
  return frame;
}

Segment ReadSegment(TomlTable& table) {
  return {ReadRows(table), ReadEntries(table.Find("joints"), ReadJointEntry),
          ReadEntries(table.Find("links"), ReadLinkEntry),
          ReadList(table.FindList("frames"), ReadFrameEntry)};
}

}  // namespace dexcheck
