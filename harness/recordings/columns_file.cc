#include "harness/recordings/columns_file.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "harness/base/files.h"
#include "harness/recordings/column_names.h"

namespace dexcheck {
namespace {

namespace fs = std::filesystem;

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
  ColumnsFile(const RobotModel& model, const LinkFrames& frames, const fs::path& path)
      : model_(model), frames_(frames), path_(path), document_(ReadBytes(path.string()), path.string()) {}

  /// @param recording its file, unless this one names it.
  Recording Open(const fs::path& recording) {
    return document_.Read([&](TomlTable root) {
      Recording result;
      result.name = (recording.empty() ? path_ : recording).filename().string();
      if (const auto topic = root.Find("topic")) topic_ = topic->AsText();
      auto joined = std::make_unique<JoinedRecording>();
      joined_ = joined.get();
      if (!recording.empty()) Add(recording, 0);
      for (const RecordedQuantity quantity : kQuantities)
        if (auto value = root.Find(NameOf(quantity))) ReadQuantity(quantity, *value, &result);
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
  void ReadQuantity(RecordedQuantity quantity, const TomlValue& value, Recording* recording) {
    std::vector<Channel>* channels = &recording->channels;
    if (quantity == RecordedQuantity::kWrench && !value.IsTable()) {
      const bool is_list = IsList(value);
      for (const TomlValue& one : is_list ? value.AsList() : std::vector<TomlValue>()) {
        if (!one.IsTable()) value.Fail("must be a table, with a link");
        ReadQuantity(quantity, one, recording);
      }
      if (!is_list) value.Fail("must be a table, with a link");
      return;
    }
    if (!value.IsTable()) {
      ReadColumns(quantity, value, 0, ListComponents(quantity), channels);
      return;
    }
    TomlTable table = value.AsTable();
    size_t first = 0;
    size_t width = 0;
    if (const auto given = table.Find("width")) width = static_cast<size_t>(given->AsWhole(1, 1000));
    if (const auto file = table.Find("file")) first = Add(path_.parent_path() / file->AsText(), width);
    std::vector<int> joints = ListComponents(quantity);
    if (quantity == RecordedQuantity::kWrench) {
      for (int& component : joints) component += 6 * static_cast<int>(recording->wrenches.size());
      const auto columns = table.Find("columns");
      if (columns && IsList(*columns) && columns->AsList().size() == 3) joints.resize(3);
      recording->wrenches.push_back(ReadWrenchPlace(&table));
    }
    const auto list = joints.empty() ? table.Find("joints") : std::nullopt;
    if (list) {
      for (const TomlValue& one : list->AsList()) joints.push_back(FindJoint(one));
    }
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
      for (size_t i = 0; i < count; ++i) {
        if (std::string_view(key) == "ratio" && numbers[i] == 0.0) factors->Fail("must not be 0");
        if (std::string_view(key) == "sign" && std::abs(numbers[i]) != 1.0) factors->Fail("must be 1 or -1");
        apply(numbers[i], &(*channels)[begin + i]);
      }
    };
    if (const auto unit = table.Find("unit")) {
      const Unit* found = FindUnit(unit->AsText(), quantity);
      if (found == nullptr) unit->Fail("must be a unit of " + std::string(NameOf(quantity)));
      for (size_t i = begin; i < channels->size(); ++i)
        (*channels)[i].scale = found->scale, (*channels)[i].states_unit = true;
    }
    scale("ratio", [](double x, Channel* channel) { channel->scale *= x; });
    scale("sign", [](double x, Channel* channel) { channel->scale *= x; });
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

  void ReadColumns(RecordedQuantity quantity, const TomlValue& value, size_t first,
                   const std::vector<int>& joints, std::vector<Channel>* channels) {
    std::vector<size_t> columns;
    if (IsList(value)) {
      for (const TomlValue& one : value.AsList()) columns.push_back(first + FindColumn(one, first));
    } else {
      columns.push_back(first + FindColumn(value, first));
    }
    if (quantity == RecordedQuantity::kTime) {
      if (columns.size() != 1) value.Fail("must be one column");
      channels->push_back({quantity, -1, columns.front()});
      return;
    }
    const size_t most = joints.empty() ? static_cast<size_t>(model_.num_joints()) : joints.size();
    if (columns.size() > most || (!joints.empty() && columns.size() != most))
      value.Fail(CountComponents(quantity) > 0 ? "must be " + std::to_string(most) + " columns"
                                               : "must be columns of " + std::to_string(most) + " joints");
    for (size_t i = 0; i < columns.size(); ++i)
      channels->push_back({quantity, joints.empty() ? static_cast<int>(i) : joints[i], columns[i]});
  }
  /// All columns of its file.
  void AddAll(RecordedQuantity quantity, const TomlValue& value, size_t first, const std::vector<int>& joints,
              std::vector<Channel>* channels) const {
    const size_t count = joined_->names().size() - first;
    const size_t most = quantity == RecordedQuantity::kTime ? 1
                        : joints.empty()                    ? static_cast<size_t>(model_.num_joints())
                                                            : joints.size();
    if (count == 0 || count > most || (CountComponents(quantity) > 0 && count < most))
      value.Fail("columns: must say which of " + std::to_string(count) + " columns");
    for (size_t i = 0; i < count; ++i) {
      const int joint = quantity == RecordedQuantity::kTime ? -1
                        : joints.empty()                    ? static_cast<int>(i)
                                                            : joints[i];
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

  static std::vector<int> ListComponents(RecordedQuantity quantity) {
    std::vector<int> components(static_cast<size_t>(CountComponents(quantity)));
    std::iota(components.begin(), components.end(), 0);
    return components;
  }

  [[nodiscard]] int FindLink(const TomlValue& link) const {
    for (int joint = 0; joint < model_.num_joints(); ++joint)
      if (model_.link_name(joint) == link.AsText()) return joint;
    link.Fail("must be a moving link of " + model_.name());
  }

  [[nodiscard]] WrenchPlace ReadWrenchPlace(TomlTable* table) const {
    WrenchPlace place;
    place.link = FindLink(table->Get("link"));
    if (const auto point = table->Find("point")) place.point = point->AsVector<3>();
    place.point = frames_.Find(place.link) * place.point;
    place.R_iL = frames_.Find(place.link).linear();
    if (const auto below = table->Find("below")) place.below = below->AsPositive();
    if (const auto axes = table->Find("axes")) {
      place.is_world = axes->AsText() == "world";
      if (!place.is_world && axes->AsText() != "link") axes->Fail("must be \"link\" or \"world\"");
    }
    return place;
  }

  [[nodiscard]] DeclaredPayload ReadPayload(TomlTable table) const {
    DeclaredPayload payload;
    payload.link = FindLink(table.Get("link"));
    payload.mass = table.Get("mass").AsPositive();
    if (const auto com = table.Find("com")) payload.com = com->AsVector<3>();
    payload.com = frames_.Find(payload.link) * payload.com;
    table.RejectUnused();
    return payload;
  }

  const RobotModel& model_;
  const LinkFrames& frames_;
  fs::path path_;
  TomlDocument document_;
  std::string topic_;
  JoinedRecording* joined_ = nullptr;
  std::map<fs::path, size_t> files_;
};

}  // namespace

Recording OpenByColumns(const RobotModel& model, const LinkFrames& frames, const fs::path& columns,
                        const fs::path& recording) {
  return ColumnsFile(model, frames, columns).Open(recording);
}

}  // namespace dexcheck
