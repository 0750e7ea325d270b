#include "harness/corrections/table_repair.h"

#include <toml++/toml.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "harness/corrections/repair_writer.h"

namespace dexcheck {
namespace {

constexpr JointKeys kTableKeys = {
    nullptr,
    {},
    "rows/axis",
    nullptr,
    {"joints/damping", "joints/dry_friction", "joints/armature", nullptr, nullptr, nullptr, nullptr, nullptr},
    ", ",
    "[{}]"};

/// A parameter file, in whose text single values are replaced.
class TableRepair final : private RepairWriter {
 public:
  TableRepair(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after)
      : RepairWriter(file, kTableKeys, before, after), text_(file.text()), root_(toml::parse(text_)) {
    for (size_t at = 0; at != std::string::npos;
         at = text_.find('\n', at), at += at == std::string::npos ? 0 : 1)
      lines_.push_back(at);
  }

  std::string Write() {
    for (int i = 1; i < before_.size(); ++i) {
      const PrintedLink& before = before_.link(i);
      const PrintedLink& after = after_.link(i);
      if (IsOther(before.origin, after.origin)) {
        before.is_frame ? WriteFrame(before, after.origin) : WriteRow(before, after.origin);
      }
      if (IsOther(before.inertial, after.inertial)) WriteBody(before, after);
      WriteJoint(i);
    }
    if (before_.link(0).inertial && IsOther(before_.link(0).inertial, after_.link(0).inertial))
      Refuse("the base's numbers must be written by hand");
    if (after_.gravity && after_.gravity != before_.gravity)
      Set(root_, "gravity", JoinVector(*after_.gravity));
    std::ranges::stable_sort(edits_, std::greater<>(), &Edit::begin);
    for (const Edit& edit : edits_) text_.replace(edit.begin, edit.end - edit.begin, edit.text);
    return text_;
  }

 private:
  /// A table of the file.
  struct Entry {
    const toml::table* table;
    bool states_convention;  ///< Of its chain's rows.
  };
  struct Edit {
    size_t begin, end;
    std::string text;
  };

  /// The entry of a list that has this name; none where there is none.
  [[nodiscard]] static std::optional<Entry> FindIn(const toml::array* list, const char* key,
                                                   const std::string& name, bool states) {
    for (size_t k = 0; list != nullptr && k < list->size(); ++k) {
      const toml::table* const entry = list->get(k)->as_table();
      if ((*entry)[key].value_or(std::string()) == name) return Entry{entry, states};
    }
    return std::nullopt;
  }

  /// The row, the frame, or the entry below `key`, of a joint or link of that name.
  [[nodiscard]] std::optional<Entry> Look(const std::string& key, const std::string& name) const {
    const toml::array* const chains = root_["chain"].as_array();
    for (size_t i = 0; chains != nullptr && i < chains->size(); ++i) {
      const toml::table& chain = *chains->get(i)->as_table();
      const std::string prefix = chain["prefix"].value_or(std::string());
      if (!name.starts_with(prefix)) continue;
      const std::string own = name.substr(prefix.size());
      const bool states = chain.contains("convention");
      if (const toml::table* const entry = chain[key][own].as_table()) return Entry{entry, states};
      const auto found = FindIn(chain[key].as_array(), key == "rows" ? "joint" : "name", own, states);
      if (found) return found;
    }
    return std::nullopt;
  }
  [[nodiscard]] Entry Find(const std::string& key, const std::string& name) const {
    if (const std::optional<Entry> entry = Look(key, name)) return *entry;
    Refuse(fmt::format("{} is not among the {} of its chain", name, key));
  }

  [[nodiscard]] size_t OffsetOf(const toml::source_position& at) const {
    return lines_[at.line - 1] + at.column - 1;
  }
  /// Sets a key, in the place of one in degrees, or adds it.
  void Set(const toml::table& table, const std::string& key, const std::string& value) {
    const std::string assignment = key + " = " + value;
    const size_t end = OffsetOf(table.source().end);
    if (const auto own = table.find(key); own != table.end()) {
      const toml::source_region& was = own->second.source();
      edits_.push_back({OffsetOf(was.begin), OffsetOf(was.end), value});
    } else if (const auto degrees = table.find(key + "_deg"); degrees != table.end()) {
      edits_.push_back(
          {OffsetOf(degrees->first.source().begin), OffsetOf(degrees->second.source().end), assignment});
    } else if (table.is_inline()) {
      const size_t last = text_.find_last_not_of(" \t", end - 2) + 1;
      edits_.push_back({last, last, (table.empty() ? "" : ", ") + assignment});
    } else {
      edits_.push_back({end, end, "\n" + assignment});
    }
  }
  void SetOfJoint(const PrintedLink& link, const std::string& path, const std::string& value) override {
    const size_t slash = path.find('/');
    Set(*Find(path.substr(0, slash), link.joint.name).table, path.substr(slash + 1), value);
  }
  void WriteRange(const PrintedLink& link, double lower, double upper) override {
    Set(*Find("joints", link.joint.name).table, "range", JoinVector(Vector2d(lower, upper)));
  }

  void WriteRow(const PrintedLink& link, PrintedOrigin origin) {
    const Entry row = Find("rows", link.joint.name);
    if (PrintedOrigin given = link.origin; given.form == RotationForm::kMdh) {
      given.SetRow(origin.CalcPose());
      if (given.CalcPose().isApprox(origin.CalcPose(), 1e-9)) origin = given;
    }
    RefuseIf(origin.form != link.origin.form || row.states_convention, link, "its row");
    if (origin.form == RotationForm::kMdh) {
      Set(*row.table, "alpha", Format(origin.r[0]));
      Set(*row.table, "q", Format(origin.r[1]));
      Set(*row.table, "a", Format(origin.t[0]));
      Set(*row.table, "d", Format(origin.t[2]));
      return;
    }
    SetPose(*row.table, link.origin, origin);
  }

  /// Writes an entry of the file's "frame", or of a chain's "frames".
  void WriteFrame(const PrintedLink& frame, const PrintedOrigin& origin) {
    std::optional<Entry> entry = FindIn(root_["frame"].as_array(), "name", frame.name, false);
    if (!entry) entry = Look("frames", frame.name);
    if (!entry) Refuse("frame " + frame.name + " must be written by hand");
    SetPose(*entry->table, frame.origin, origin);
  }

  void SetPose(const toml::table& entry, const PrintedOrigin& before, const PrintedOrigin& origin) {
    if (before.t != origin.t) Set(entry, "xyz", JoinVector(origin.t));
    if (IsTurned(before, origin)) Set(entry, "rpy", JoinVector(Vector3d(origin.r.head<3>())));
  }

  void WriteBody(const PrintedLink& before, const PrintedLink& after) {
    const Entry entry = Find("links", before.name);
    RefuseIf(!entry.table->contains("mass") || !after.inertial, before, "its link");
    Set(*entry.table, "mass", Format(after.inertial->mass.value));
    Set(*entry.table, "com", JoinVector(after.inertial->origin.t));
    Set(*entry.table, "inertia", JoinVector(CalcInertia(*after.inertial)));
  }

  std::string text_;
  toml::table root_;
  std::vector<size_t> lines_;  // begins of them
  std::vector<Edit> edits_;
};

}  // namespace

std::string WriteTable(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after) {
  return TableRepair(file, before, after).Write();
}

}  // namespace dexcheck
