#include "controller/model/segment_reader.h"

#include "controller/model/body_reader.h"

namespace dexcheck {
namespace {

SegmentRow ReadRow(const TomlValue& value) {
  TomlTable table = value.AsTable();
  SegmentRow row{value, table.Get("joint").AsName(), table.Get("link").AsName(), JointType::kRevolute, {}};
  if (const std::optional<TomlValue> type = table.Find("type")) {
    row.type =
        type->AsChoice<JointType>({{"revolute", JointType::kRevolute}, {"prismatic", JointType::kPrismatic}});
  }
  row.mdh.alpha = table.GetAngle("alpha");
  row.mdh.a = table.Get("a").AsNumber();
  row.mdh.q = table.GetAngle("q");
  row.mdh.d = table.Get("d").AsNumber();
  table.RejectUnused();
  return row;
}

JointEntry ReadJointEntry(const TomlValue& value) {
  TomlTable table = value.AsTable();
  const auto [range, unit] = table.FindWithAngleUnit("range");
  if (!range) table.FailMissing("range");
  const Vector2d limits = unit * range->AsVector<2>();
  if (limits[0] > limits[1]) range->Fail("lower limit must not exceed upper limit");
  JointEntry entry{value,
                   *range,
                   unit != 1.0,
                   limits[0],
                   limits[1],
                   table.Get("damping").AsNotNegative(),
                   table.Get("armature").AsNotNegative()};
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
  return {ReadList(table.Find("rows"), ReadRow), ReadEntries(table.Find("joints"), ReadJointEntry),
          ReadEntries(table.Find("links"), ReadLinkEntry), ReadList(table.Find("frames"), ReadFrameEntry)};
}

}  // namespace dexcheck
