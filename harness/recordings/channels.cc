#include "harness/recordings/channels.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/recordings/column_names.h"
#include "harness/recordings/columns_file.h"

namespace dexcheck {
namespace {

namespace fs = std::filesystem;

/// "column 3 (tau_2)".
std::string Describe(const RecordingReader& reader, size_t column) {
  const std::string& name = reader.names()[column];
  return "column " + std::to_string(column + 1) + (name.empty() ? "" : " (" + name + ")");
}

void Require(const RobotModel& model, const Recording& recording, const std::string& source) {
  const auto fail = [&](const std::string& problem) { throw InputError(source + ": " + problem); };
  if (!recording.Has(RecordedQuantity::kTime))
    fail("has no column of time; a file of --columns can name it (judge --describe writes one)");
  if (!recording.Has(RecordedQuantity::kPosition))
    fail(
        "has no column that is known as a joint's position; a file of --columns can name them (judge "
        "--describe writes one)");
  if (!recording.Has(RecordedQuantity::kTorque) && !recording.Has(RecordedQuantity::kCurrent))
    fail("has no column that is known as a joint's torque or current; a file of --columns can name them");
  for (const Channel& one : recording.channels)
    if (one.quantity != RecordedQuantity::kTime && CountComponents(one.quantity) == 0 &&
        recording.FindColumn(RecordedQuantity::kPosition, one.joint) < 0)
      fail("joint " + model.joint(one.joint).name + " has " + NameOf(one.quantity) + " and no position");
  std::set<std::pair<RecordedQuantity, int>> seen;
  for (const Channel& one : recording.channels)
    if (!seen.emplace(one.quantity, one.joint).second && one.joint >= 0)
      fail(std::string("has two columns of ") + NameOf(one.quantity) + " of joint " +
           (CountComponents(one.quantity) > 0 ? std::to_string(one.joint + 1) : model.joint(one.joint).name));
  std::map<size_t, const Channel*> owners;
  for (const Channel& one : recording.channels)
    if (!owners.emplace(one.column, &one).second)
      fail(Describe(*recording.reader, one.column) + " is both " + NameOf(owners[one.column]->quantity) +
           " and " + NameOf(one.quantity));
}

}  // namespace

const char* NameOf(RecordedQuantity quantity) {
  constexpr const char* kNames[] = {"t", "q", "qd", "qdd", "tau", "current", "wrench", "base"};
  return kNames[static_cast<size_t>(quantity)];
}

int CountComponents(RecordedQuantity quantity) {
  return quantity == RecordedQuantity::kWrench ? 6 : quantity == RecordedQuantity::kBase ? 7 : 0;
}

int Recording::FindColumn(RecordedQuantity quantity, int joint) const {
  for (const Channel& one : channels)
    if (one.quantity == quantity && one.joint == joint) return static_cast<int>(one.column);
  return -1;
}

bool Recording::Has(RecordedQuantity quantity) const {
  return std::any_of(channels.begin(), channels.end(),
                     [&](const Channel& one) { return one.quantity == quantity; });
}

std::string LinkFrames::NameOf(const std::string& link) const {
  return link + "'s " + kind + (file.empty() ? "" : " of " + file);
}

LinkFrames ListLinkFrames(const RobotDescription& robot) {
  LinkFrames frames;
  for (const DescribedJoint& joint : robot.joints) frames.X_iL.push_back(joint.X_iL);
  frames.kind = robot.format == RobotFormat::kMjcf ? "body frame" : "link frame";
  frames.file = fs::path(robot.spec.source).filename().string();
  return frames;
}

RobotModel MakeUnknownRobot(int joints) {
  RobotSpec spec;
  spec.name = spec.source = "unknown";
  for (int i = 0; i < joints; ++i) {
    Joint& joint = spec.joints.emplace_back();
    joint.name = "joint " + std::to_string(i + 1);
    joint.link = "link " + std::to_string(i + 1);
    joint.parent = i - 1;
    joint.lower = -kPi;
    joint.upper = kPi;
    joint.body = {1.0, Vector3d::Zero(), Matrix3d::Identity()};
  }
  return RobotModel(spec);
}

Recording OpenRecordingOf(const RobotModel& model, const fs::path& path, const fs::path& columns,
                          bool is_complete, const LinkFrames& frames) {
  Recording recording;
  const bool names_files = path.extension() == ".toml";
  if (names_files || !columns.empty()) {
    recording = OpenByColumns(model, frames, names_files ? path : columns, names_files ? fs::path() : path);
  } else {
    recording.name = path == "-" ? "standard input" : path.filename().string();
    recording.reader = OpenRecording(path);
    recording.channels = GuessChannels(model, recording.reader->names());
    GuessFeet(model, recording.reader->names(), &recording);
  }
  if (is_complete)
    Require(model, recording, names_files ? path.string() : path == "-" ? "standard input" : path.string());
  if (!IsReadOnce(path))
    recording.reopen = [=, &model] { return OpenRecordingOf(model, path, columns, is_complete, frames); };
  return recording;
}

std::string DescribeColumns(const RobotModel& model, const Recording& recording, const LinkFrames& frames) {
  const std::vector<std::string>& names = recording.reader->names();
  std::string text = fmt::format("# {}: {} columns", recording.reader->format(), names.size());
  if (!recording.reader->has_names()) text += ", without a header";
  text +=
      "\n# Numbers count columns from 1. unit: s, ms, us, ns; rad, deg, turn, m, mm; N m, mN m; A, mA.\n"
      "# Each may have: joints = [...], sign = [...], ratio = [...], offset = [...], file = \"...\".\n";
  std::set<size_t> used;
  const auto describe = [&](RecordedQuantity quantity, int first, const std::string& head) {
    std::string columns, joints;
    double scale = 1.0;
    for (const Channel& one : recording.channels) {
      const bool is_other = quantity == RecordedQuantity::kWrench && one.joint / 6 != first / 6;
      if (one.quantity != quantity || is_other) continue;
      used.insert(one.column);
      scale = one.scale;
      const std::string separator = columns.empty() ? "" : ", ";
      columns += separator +
                 (names[one.column].empty() ? std::to_string(one.column + 1) : QuoteToml(names[one.column]));
      if (one.joint >= 0 && CountComponents(quantity) == 0)
        joints += separator + QuoteToml(model.joint(one.joint).name);
    }
    if (columns.empty()) {
      text += fmt::format("\n# {}\n# columns = []\n", head);
      if (quantity == RecordedQuantity::kWrench) text += "# link = \"\"\n";
      return;
    }
    text += fmt::format("\n{}\ncolumns = [{}]\n", head, columns);
    if (!joints.empty()) text += fmt::format("joints = [{}]\n", joints);
    if (quantity == RecordedQuantity::kWrench) {
      const WrenchPlace& place = recording.wrenches[static_cast<size_t>(first / 6)];
      const Vector3d point = frames.Find(place.link).inverse() * place.point;
      text += fmt::format("link = {}\npoint = [{}, {}, {}]\naxes = \"{}\"\n",
                          QuoteToml(model.link_name(place.link)), point[0], point[1], point[2],
                          place.is_world ? "world" : "link");
      if (place.below > 0.0) text += fmt::format("below = {}\n", place.below);
    }
    for (const Unit& unit : ListUnits())
      if (scale != 1.0 && unit.scale == scale && FindUnit(std::string(unit.name), quantity) == &unit)
        text += fmt::format("unit = \"{}\"\n", unit.name);
  };
  for (const RecordedQuantity quantity : kQuantities)
    if (quantity != RecordedQuantity::kWrench || recording.wrenches.empty())
      describe(quantity, 0, fmt::format("[{}]", NameOf(quantity)));
  for (size_t i = 0; i < recording.wrenches.size(); ++i)
    describe(RecordedQuantity::kWrench, 6 * static_cast<int>(i), "[[wrench]]");
  std::string unused;
  for (size_t i = 0; i < names.size(); ++i)
    if (!used.contains(i))
      unused +=
          (unused.empty() ? "" : ", ") + (names[i].empty() ? std::to_string(i + 1) : Abbreviate(names[i]));
  if (!unused.empty()) text += "\n# Not used: " + unused + "\n";
  return text;
}

}  // namespace dexcheck
