#include "controller/model/segment_reader.h"

#include "controller/model/body_frame.h"
#include "controller/model/body_reader.h"

namespace dexcheck {
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
  // A ball turns about all axes of the link's own frame, placed by a plain transform.
  if (row.type == JointType::kBall) {
    row.X_before = ReadPose(table);
    row.written.is_plain = true;
    table.RejectUnused();
    return row;
  }
  bool is_plain = false;
  for (const char* key : {"xyz", "rpy", "rpy_deg", "axis"}) {
    table.RejectTogether(key, {"alpha", "alpha_deg", "a", "q", "q_deg", "d"});
    is_plain = is_plain || table.Find(key);
  }
  if (is_plain) {
    ReadPlainTransform(table, row);
    table.RejectUnused();
    return row;
  }
  row.mdh.alpha = table.GetAngle("alpha");
  row.mdh.a = table.Get("a").AsNumber();
  row.mdh.q = table.GetAngle("q");
  row.mdh.d = table.Get("d").AsNumber();
  table.RejectUnused();
  if (convention == Convention::kClassic) MakeClassic(row);
  return row;
}

std::vector<SegmentRow> ReadRows(TomlTable& table) {
  Convention convention = Convention::kModified;
  if (const std::optional<TomlValue> value = table.Find("convention")) {
    convention =
        value->AsChoice<Convention>({{"modified", Convention::kModified}, {"classic", Convention::kClassic}});
  }
  std::vector<SegmentRow> rows;
  const std::optional<TomlValue> list = table.Find("rows");
  if (!list) return rows;
  for (const TomlValue& value : list->AsList()) rows.push_back(ReadRow(value, convention));
  return rows;
}

MimicEntry ReadMimic(const TomlValue& value) {
  TomlTable table = value.AsTable();
  const std::optional<TomlValue> multiplier = table.Find("multiplier");
  const std::optional<TomlValue> offset = table.Find("offset");
  MimicEntry entry{table.Get("joint"), multiplier ? multiplier->AsNumber() : 1.0,
                   offset ? offset->AsNumber() : 0.0};
  table.RejectUnused();
  return entry;
}

JointEntry ReadJointEntry(const TomlValue& value) {
  TomlTable table = value.AsTable();
  auto [range, unit] = table.FindWithAngleUnit("range");
  if (!range) range = table.Miss("range");
  const Vector2d limits = unit * range->AsVector<2>();
  if (limits[0] > limits[1]) range->Fail("lower limit must not exceed upper limit");
  const std::optional<TomlValue> dry_friction = table.Find("dry_friction");
  const std::optional<TomlValue> mimic = table.Find("mimic");
  JointEntry entry{value,
                   *range,
                   unit != 1.0,
                   limits[0],
                   limits[1],
                   table.Get("damping").AsNotNegative(),
                   table.Get("armature").AsNotNegative(),
                   dry_friction ? dry_friction->AsNotNegative() : 0.0,
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

/// A list of entries.
template <typename Entry>
std::vector<Entry> ReadList(const std::optional<TomlValue>& value, Entry (*read)(const TomlValue&)) {
  std::vector<Entry> entries;
  if (!value) return entries;
  for (const TomlValue& entry : value->AsList()) entries.push_back(read(entry));
  return entries;
}

}  // namespace

FrameEntry ReadFrameEntry(const TomlValue& value) {
  TomlTable table = value.AsTable();
  FrameEntry frame{value, table.Get("name"), table.Get("link"), ReadPose(table), std::nullopt};
  if (const std::optional<TomlValue> radius = table.Find("sphere_radius")) {
    frame.sphere_radius = radius->AsPositive();
  }
  table.RejectUnused();
  return frame;
}

Segment ReadSegment(TomlTable& table) {
  return {ReadRows(table), ReadEntries(table.Find("joints"), ReadJointEntry),
          ReadEntries(table.Find("links"), ReadLinkEntry), ReadList(table.Find("frames"), ReadFrameEntry)};
}

}  // namespace dexcheck
