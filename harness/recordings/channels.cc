#include "harness/recordings/channels.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <set>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"

namespace dexcheck {
namespace {

namespace fs = std::filesystem;

constexpr Quantity kQuantities[] = {Quantity::kTime,         Quantity::kPosition, Quantity::kVelocity,
                                    Quantity::kAcceleration, Quantity::kTorque,   Quantity::kCurrent};

/// Words that logs use for a quantity.
struct Word {
  std::string_view word;
  Quantity quantity;
};
constexpr Word kWords[] = {
    {"t", Quantity::kTime},
    {"time", Quantity::kTime},
    {"timestamp", Quantity::kTime},
    {"stamp", Quantity::kTime},
    {"secs", Quantity::kTime},
    {"seconds", Quantity::kTime},
    {"q", Quantity::kPosition},
    {"pos", Quantity::kPosition},
    {"position", Quantity::kPosition},
    {"positions", Quantity::kPosition},
    {"angle", Quantity::kPosition},
    {"qpos", Quantity::kPosition},
    {"theta", Quantity::kPosition},
    {"qd", Quantity::kVelocity},
    {"dq", Quantity::kVelocity},
    {"vel", Quantity::kVelocity},
    {"velocity", Quantity::kVelocity},
    {"velocities", Quantity::kVelocity},
    {"qvel", Quantity::kVelocity},
    {"qdot", Quantity::kVelocity},
    {"speed", Quantity::kVelocity},
    {"xi", Quantity::kVelocity},
    {"qdd", Quantity::kAcceleration},
    {"ddq", Quantity::kAcceleration},
    {"acc", Quantity::kAcceleration},
    {"acceleration", Quantity::kAcceleration},
    {"qacc", Quantity::kAcceleration},
    {"qddot", Quantity::kAcceleration},
    {"tau", Quantity::kTorque},
    {"torque", Quantity::kTorque},
    {"torques", Quantity::kTorque},
    {"effort", Quantity::kTorque},
    {"efforts", Quantity::kTorque},
    {"trq", Quantity::kTorque},
    {"force", Quantity::kTorque},
    {"current", Quantity::kCurrent},
    {"currents", Quantity::kCurrent},
    {"amps", Quantity::kCurrent},
    {"i", Quantity::kCurrent},
};
/// What is commanded is no measurement.
constexpr std::string_view kCommanded[] = {"cmd",      "command", "commanded", "des", "desired", "target",
                                           "setpoint", "ref",     "reference", "d",   "error",   "ext"};

struct Unit {
  std::string_view name;
  Quantity quantity;
  double scale;
};
constexpr Unit kUnits[] = {
    {"s", Quantity::kTime, 1.0},
    {"ms", Quantity::kTime, 1e-3},
    {"us", Quantity::kTime, 1e-6},
    {"ns", Quantity::kTime, 1e-9},
    {"rad", Quantity::kPosition, 1.0},
    {"deg", Quantity::kPosition, kPi / 180.0},
    {"m", Quantity::kPosition, 1.0},
    {"mm", Quantity::kPosition, 1e-3},
    {"turn", Quantity::kPosition, 2.0 * kPi},
    {"nm", Quantity::kTorque, 1.0},
    {"n", Quantity::kTorque, 1.0},
    {"mnm", Quantity::kTorque, 1e-3},
    {"a", Quantity::kCurrent, 1.0},
    {"ma", Quantity::kCurrent, 1e-3},
};

/// The unit of a quantity; positions' units serve their rates, too.
const Unit* FindUnit(std::string name, Quantity quantity) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  std::erase_if(name, [](char c) { return c == ' ' || c == '*' || c == '.'; });
  // "rad/s", "deg/s^2"
  if (const size_t slash = name.find('/'); slash != std::string::npos) name.resize(slash);
  if (quantity == Quantity::kVelocity || quantity == Quantity::kAcceleration) quantity = Quantity::kPosition;
  const auto found = std::find_if(std::begin(kUnits), std::end(kUnits), [&](const Unit& unit) {
    return unit.name == name && unit.quantity == quantity;
  });
  return found == std::end(kUnits) ? nullptr : found;
}

bool IsLetter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool IsDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

std::string ToLower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Words and numbers of a name.
std::vector<std::string> SplitWords(const std::string& name) {
  std::vector<std::string> words;
  for (size_t i = 0; i < name.size(); ++i) {
    const bool is_letter = IsLetter(name[i]), is_digit = IsDigit(name[i]);
    if (!is_letter && !is_digit) continue;
    const bool goes_on =
        i > 0 && !words.empty() && (is_letter ? IsLetter(name[i - 1]) : IsDigit(name[i - 1]));
    if (goes_on) {
      words.back() += name[i];
    } else {
      words.emplace_back(1, name[i]);
    }
  }
  return words;
}

/// What a column's name says.
struct NamedColumn {
  std::optional<Quantity> quantity;
  int joint = -1;
  int number = -1;  // instead of a joint's name
  double scale = 1.0;
  bool is_commanded = false;
};

NamedColumn ReadName(const RobotModel& model, const std::string& written) {
  NamedColumn column;
  std::string name = ToLower(written);
  size_t longest = 0, at = 0;
  for (int joint = 0; joint < model.num_joints(); ++joint) {
    const std::string own = ToLower(model.joint(joint).name);
    const size_t found = name.rfind(own);
    if (found == std::string::npos || own.size() <= longest) continue;
    const size_t end = found + own.size();
    if ((found > 0 && (IsLetter(name[found - 1]) || IsDigit(name[found - 1]))) ||
        (end < name.size() && IsDigit(name[end]) && IsDigit(own.back())))
      continue;
    longest = own.size();
    at = found;
    column.joint = joint;
  }
  if (column.joint >= 0) name.replace(at, longest, "/");
  const std::vector<std::string> words = SplitWords(name);
  for (const std::string& word : words) {
    const auto quantity =
        std::find_if(std::begin(kWords), std::end(kWords), [&](const Word& one) { return one.word == word; });
    const bool is_unit = column.quantity && FindUnit(word, *column.quantity) != nullptr;
    if (std::find(std::begin(kCommanded), std::end(kCommanded), word) != std::end(kCommanded)) {
      column.is_commanded = true;
    } else if (is_unit) {
      column.scale = FindUnit(word, *column.quantity)->scale;
    } else if (quantity != std::end(kWords) && !(word == "t" && words.size() > 2)) {
      column.quantity = quantity->quantity;
    } else if (IsDigit(word[0]) && word.size() < 4) {
      column.number = std::stoi(word);
    }
  }
  return column;
}

const std::string& NameOfColumn(const RecordingReader& reader, size_t column) {
  return reader.names()[column];
}

/// "column 3 (tau_2)".
std::string Describe(const RecordingReader& reader, size_t column) {
  const std::string& name = NameOfColumn(reader, column);
  return "column " + std::to_string(column + 1) + (name.empty() ? "" : " (" + name + ")");
}

/// Several files whose rows belong together.
class JoinedRecording : public RecordingReader {
 public:
  /// @return the first of its columns here.
  size_t Add(std::unique_ptr<RecordingReader> reader) {
    const size_t first = names_.size();
    names_.insert(names_.end(), reader->names().begin(), reader->names().end());
    has_names_ = has_names_ || reader->has_names();
    if (format_.empty()) format_ = reader->format();
    readers_.push_back(std::move(reader));
    return first;
  }
  bool Next(std::vector<double>* row) override {
    row->clear();
    size_t ended = 0;
    for (const auto& reader : readers_) {
      if (!reader->Next(&part_)) ++ended;
      row->insert(row->end(), part_.begin(), part_.end());
    }
    if (ended > 0 && ended < readers_.size())
      throw InputError(Where() + ": files of one recording have different numbers of rows");
    return ended == 0;
  }
  [[nodiscard]] std::string Where() const override { return readers_.front()->Where(); }

 private:
  std::vector<std::unique_ptr<RecordingReader>> readers_;
  std::vector<double> part_;
};

/// Reads a file of columns.
class ColumnsFile {
 public:
  ColumnsFile(const RobotModel& model, const fs::path& path)
      : model_(model), path_(path), document_(ReadTextFile(path.string()), path.string()) {}

  /// @param recording its file, unless this one names it.
  Recording Open(const fs::path& recording) {
    return document_.Read([&](TomlTable root) {
      Recording result;
      result.name = (recording.empty() ? path_ : recording).filename().string();
      if (const auto topic = root.Find("topic")) topic_ = topic->AsText();
      auto joined = std::make_unique<JoinedRecording>();
      joined_ = joined.get();
      if (!recording.empty()) Add(recording, 0);
      for (const Quantity quantity : kQuantities)
        if (auto value = root.Find(NameOf(quantity))) ReadQuantity(quantity, *value, &result.channels);
      if (auto payload = root.Find("payload")) result.payload = ReadPayload(payload->AsTable());
      root.RejectUnused();
      if (joined_->names().empty()) throw InputError(path_.string() + ": names no file");
      result.reader = std::move(joined);
      return result;
    });
  }

 private:
  size_t Add(const fs::path& file, size_t width) {
    const auto [place, is_new] = files_.emplace(file, 0);
    if (is_new) place->second = joined_->Add(OpenRecording(file, topic_, width));
    return place->second;
  }

  /// "q = [2, 3]", or a table.
  void ReadQuantity(Quantity quantity, const TomlValue& value, std::vector<Channel>* channels) {
    if (!value.IsTable()) {
      ReadColumns(quantity, value, 0, {}, channels);
      return;
    }
    TomlTable table = value.AsTable();
    size_t first = 0;
    size_t width = 0;
    if (const auto given = table.Find("width")) width = static_cast<size_t>(given->AsWhole(1, 1000));
    if (const auto file = table.Find("file")) first = Add(path_.parent_path() / file->AsText(), width);
    std::vector<int> joints;
    if (const auto list = table.Find("joints"))
      for (const TomlValue& one : list->AsList()) joints.push_back(FindJoint(one));
    const size_t begin = channels->size();
    if (const auto columns = table.Find("columns")) {
      ReadColumns(quantity, *columns, first, joints, channels);
    } else {
      AddAll(quantity, value, first, joints, channels);
    }
    const size_t count = channels->size() - begin;
    const auto scale = [&](const char* key, const auto& apply) {
      const auto factors = table.Find(key);
      if (!factors) return;
      const std::vector<double> numbers = ReadNumbers(*factors, count);
      for (size_t i = 0; i < count; ++i) apply(numbers[i], &(*channels)[begin + i]);
    };
    if (const auto unit = table.Find("unit")) {
      const Unit* found = FindUnit(unit->AsText(), quantity);
      if (found == nullptr) unit->Fail("must be a unit of " + std::string(NameOf(quantity)));
      for (size_t i = begin; i < channels->size(); ++i) (*channels)[i].scale = found->scale;
    }
    scale("ratio", [](double x, Channel* channel) { channel->scale *= x; });
    scale("sign", [](double x, Channel* channel) { channel->scale *= x < 0.0 ? -1.0 : 1.0; });
    scale("offset", [](double x, Channel* channel) { channel->offset = x; });
    table.RejectUnused();
  }

  [[nodiscard]] static std::vector<double> ReadNumbers(const TomlValue& value, size_t count) {
    if (!IsList(value)) return std::vector<double>(count, value.AsNumber());
    std::vector<double> numbers;
    for (const TomlValue& one : value.AsList()) numbers.push_back(one.AsNumber());
    if (numbers.size() != count) value.Fail("must be one number or " + std::to_string(count));
    return numbers;
  }
  [[nodiscard]] static bool IsList(const TomlValue& value) { return value.Show().starts_with('['); }

  [[nodiscard]] int FindJoint(const TomlValue& value) const {
    const int joint = model_.FindJoint(value.AsText());
    if (joint < 0) value.Fail("must be a joint of " + model_.name());
    return joint;
  }

  void ReadColumns(Quantity quantity, const TomlValue& value, size_t first, const std::vector<int>& joints,
                   std::vector<Channel>* channels) {
    std::vector<size_t> columns;
    if (IsList(value)) {
      for (const TomlValue& one : value.AsList()) columns.push_back(first + FindColumn(one, first));
    } else {
      columns.push_back(first + FindColumn(value, first));
    }
    if (quantity == Quantity::kTime) {
      if (columns.size() != 1) value.Fail("must be one column");
      channels->push_back({quantity, -1, columns.front()});
      return;
    }
    const size_t most = joints.empty() ? static_cast<size_t>(model_.num_joints()) : joints.size();
    if (columns.size() > most || (!joints.empty() && columns.size() != most))
      value.Fail("must be columns of " + std::to_string(most) + " joints");
    for (size_t i = 0; i < columns.size(); ++i)
      channels->push_back({quantity, joints.empty() ? static_cast<int>(i) : joints[i], columns[i]});
  }
  /// All columns of its file.
  void AddAll(Quantity quantity, const TomlValue& value, size_t first, const std::vector<int>& joints,
              std::vector<Channel>* channels) const {
    const size_t count = joined_->names().size() - first;
    const size_t most = quantity == Quantity::kTime ? 1
                        : joints.empty()            ? static_cast<size_t>(model_.num_joints())
                                                    : joints.size();
    if (count == 0 || count > most)
      value.Fail("columns: must say which of " + std::to_string(count) + " columns");
    for (size_t i = 0; i < count; ++i) {
      const int joint = quantity == Quantity::kTime ? -1 : joints.empty() ? static_cast<int>(i) : joints[i];
      channels->push_back({quantity, joint, first + i});
    }
  }

  /// A column by its name or its number, from 1.
  [[nodiscard]] size_t FindColumn(const TomlValue& value, size_t first) const {
    const std::vector<std::string>& names = joined_->names();
    if (!value.IsText())
      return static_cast<size_t>(value.AsWhole(1, static_cast<long>(names.size() - first))) - 1;
    const auto found =
        std::find(names.begin() + static_cast<std::ptrdiff_t>(first), names.end(), value.AsText());
    if (found == names.end()) value.Fail("must be a column of the recording");
    return static_cast<size_t>(found - names.begin()) - first;
  }

  [[nodiscard]] DeclaredPayload ReadPayload(TomlTable table) const {
    DeclaredPayload payload;
    const TomlValue link = table.Get("link");
    payload.link = -1;
    for (int joint = 0; joint < model_.num_joints(); ++joint)
      if (model_.link_name(joint) == link.AsText()) payload.link = joint;
    if (payload.link < 0) link.Fail("must be a moving link of " + model_.name());
    payload.mass = table.Get("mass").AsPositive();
    if (const auto com = table.Find("com")) payload.com = com->AsVector<3>();
    table.RejectUnused();
    return payload;
  }

  const RobotModel& model_;
  fs::path path_;
  TomlDocument document_;
  std::string topic_;
  JoinedRecording* joined_ = nullptr;
  std::map<fs::path, size_t> files_;
};

void Require(const RobotModel& model, const Recording& recording, const std::string& source) {
  const auto fail = [&](const std::string& problem) { throw InputError(source + ": " + problem); };
  if (!recording.Has(Quantity::kTime))
    fail("has no column of time; a file of --columns can name it (judge --describe writes one)");
  if (!recording.Has(Quantity::kPosition))
    fail(
        "has no column that is known as a joint's position; a file of --columns can name them (judge "
        "--describe writes one)");
  if (!recording.Has(Quantity::kTorque) && !recording.Has(Quantity::kCurrent))
    fail("has no column that is known as a joint's torque or current; a file of --columns can name them");
  for (const Channel& one : recording.channels)
    if (one.quantity != Quantity::kTime && recording.FindColumn(Quantity::kPosition, one.joint) < 0)
      fail("joint " + model.joint(one.joint).name + " has " + NameOf(one.quantity) + " and no position");
  std::set<std::pair<Quantity, int>> seen;
  for (const Channel& one : recording.channels)
    if (!seen.emplace(one.quantity, one.joint).second && one.joint >= 0)
      fail(std::string("has two columns of ") + NameOf(one.quantity) + " of joint " +
           model.joint(one.joint).name);
  std::map<size_t, const Channel*> owners;
  for (const Channel& one : recording.channels)
    if (!owners.emplace(one.column, &one).second)
      fail(Describe(*recording.reader, one.column) + " is both " + NameOf(owners[one.column]->quantity) +
           " and " + NameOf(one.quantity));
}

}  // namespace

const char* NameOf(Quantity quantity) {
  constexpr const char* kNames[] = {"t", "q", "qd", "qdd", "tau", "current"};
  return kNames[static_cast<size_t>(quantity)];
}

int Recording::FindColumn(Quantity quantity, int joint) const {
  for (const Channel& one : channels)
    if (one.quantity == quantity && one.joint == joint) return static_cast<int>(one.column);
  return -1;
}

bool Recording::Has(Quantity quantity) const {
  return std::any_of(channels.begin(), channels.end(),
                     [&](const Channel& one) { return one.quantity == quantity; });
}

std::vector<Channel> GuessChannels(const RobotModel& model, const std::vector<std::string>& names) {
  std::vector<NamedColumn> columns;
  int least = 1;  // numbers count from 0 or from 1
  for (const std::string& name : names) {
    const NamedColumn& column = columns.emplace_back(ReadName(model, name));
    if (column.quantity && column.number >= 0) least = std::min(least, column.number);
  }
  std::vector<Channel> channels;
  std::set<std::pair<Quantity, int>> seen;
  for (size_t i = 0; i < columns.size(); ++i) {
    const NamedColumn& column = columns[i];
    if (!column.quantity || column.is_commanded) continue;
    int joint = -1;
    if (*column.quantity != Quantity::kTime) {
      joint = column.joint;
      if (joint < 0 && column.number >= 0) joint = column.number - least;
      // A robot of one joint needs no number.
      if (joint < 0 && model.num_joints() == 1) joint = 0;
      if (joint < 0 || joint >= model.num_joints()) continue;
    }
    if (seen.emplace(*column.quantity, joint).second)
      channels.push_back({*column.quantity, joint, i, column.scale});
  }
  return channels;
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
                          bool is_complete) {
  Recording recording;
  const bool names_files = path.extension() == ".toml";
  if (names_files || !columns.empty()) {
    recording = ColumnsFile(model, names_files ? path : columns).Open(names_files ? fs::path() : path);
  } else {
    recording.name = path == "-" ? "standard input" : path.filename().string();
    recording.reader = OpenRecording(path);
    recording.channels = GuessChannels(model, recording.reader->names());
  }
  if (is_complete)
    Require(model, recording, names_files ? path.string() : path == "-" ? "standard input" : path.string());
  if (path != "-")
    recording.reopen = [=, &model] { return OpenRecordingOf(model, path, columns, is_complete); };
  return recording;
}

std::string DescribeColumns(const RobotModel& model, const Recording& recording) {
  const std::vector<std::string>& names = recording.reader->names();
  std::string text = fmt::format("# {}: {} columns", recording.reader->format(), names.size());
  if (!recording.reader->has_names()) text += ", without a header";
  text +=
      "\n# Numbers count columns from 1. unit: s, ms, us, ns; rad, deg, turn, m, mm; N m, mN m; A, mA.\n"
      "# Each may have: joints = [...], sign = [...], ratio = [...], offset = [...], file = \"...\".\n";
  std::set<size_t> used;
  for (const Quantity quantity : kQuantities) {
    std::string columns, joints;
    double scale = 1.0;
    for (const Channel& one : recording.channels) {
      if (one.quantity != quantity) continue;
      used.insert(one.column);
      scale = one.scale;
      const std::string separator = columns.empty() ? "" : ", ";
      columns +=
          separator + (names[one.column].empty() ? std::to_string(one.column + 1) : Quote(names[one.column]));
      if (one.joint >= 0) joints += separator + Quote(model.joint(one.joint).name);
    }
    if (columns.empty()) {
      text += fmt::format("\n# [{}]\n# columns = []\n", NameOf(quantity));
      continue;
    }
    text += fmt::format("\n[{}]\ncolumns = [{}]\n", NameOf(quantity), columns);
    if (!joints.empty()) text += fmt::format("joints = [{}]\n", joints);
    for (const Unit& unit : kUnits)
      if (scale != 1.0 && unit.scale == scale && FindUnit(std::string(unit.name), quantity) == &unit)
        text += fmt::format("unit = \"{}\"\n", unit.name);
  }
  std::string unused;
  for (size_t i = 0; i < names.size(); ++i)
    if (!used.contains(i))
      unused += (unused.empty() ? "" : ", ") + (names[i].empty() ? std::to_string(i + 1) : names[i]);
  if (!unused.empty()) text += "\n# Not used: " + unused + "\n";
  return text;
}

}  // namespace dexcheck
