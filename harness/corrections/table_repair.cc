#include "harness/corrections/table_repair.h"

#include <toml++/toml.h>

#include <vector>

#include "controller/common/toml_reader.h"
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

/// Assignments to keys of a parameter file.
class TableRepair final : private RepairWriter {
 public:
  TableRepair(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after)
      : RepairWriter(file, kTableKeys, before, after),
        source_(file.path().string()),
        text_(file.text()),
        root_(toml::parse(text_)) {}

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
    return ApplyOverrides(text_, source_, assignments_);
  }

 private:
  /// A table of the file and the path that leads to it: "chain.0.rows.3".
  struct Entry {
    const toml::table* table;
    std::string path;
    bool states_convention;  ///< Of its chain's rows.
  };

  /// The entry of a list that has this name; none where there is none.
  [[nodiscard]] static std::optional<Entry> FindIn(const toml::array* list, const std::string& begin,
                                                   const char* key, const std::string& name, bool states) {
    for (size_t k = 0; list != nullptr && k < list->size(); ++k) {
      const toml::table* const entry = list->get(k)->as_table();
      if ((*entry)[key].value_or(std::string()) == name)
        return Entry{entry, begin + std::to_string(k), states};
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
      const std::string begin = fmt::format("chain.{}.{}.", i, key);
      const bool states = chain.contains("convention");
      if (const toml::table* const entry = chain[key][own].as_table())
        return Entry{entry, begin + own, states};
      const auto found = FindIn(chain[key].as_array(), begin, key == "rows" ? "joint" : "name", own, states);
      if (found) return found;
    }
    return std::nullopt;
  }
  [[nodiscard]] Entry Find(const std::string& key, const std::string& name) const {
    if (const std::optional<Entry> entry = Look(key, name)) return *entry;
    Refuse(fmt::format("{} is not among the {} of its chain", name, key));
  }

  void Set(const Entry& entry, const char* key, const std::string& value) {
    assignments_.push_back(entry.path + "." + key + "=" + value);
  }
  void Remove(const Entry& entry, const char* key) {
    if (entry.table->contains(key)) assignments_.push_back(entry.path + "." + key + "-=");
  }
  void SetOfJoint(const PrintedLink& link, const std::string& path, const std::string& value) override {
    const size_t slash = path.find('/');
    Set(Find(path.substr(0, slash), link.joint.name), path.substr(slash + 1).c_str(), value);
  }
  void WriteRange(const PrintedLink& link, double lower, double upper) override {
    const Entry entry = Find("joints", link.joint.name);
    Remove(entry, "range_deg");
    Set(entry, "range", JoinVector(Vector2d(lower, upper)));
  }

  void WriteRow(const PrintedLink& link, PrintedOrigin origin) {
    const Entry row = Find("rows", link.joint.name);
    if (PrintedOrigin given = link.origin; given.form == RotationForm::kMdh) {
      given.SetRow(origin.CalcPose());
      if (given.CalcPose().isApprox(origin.CalcPose(), 1e-9)) origin = given;
    }
    RefuseIf(origin.form != link.origin.form || row.states_convention, link, "its row");
    if (origin.form == RotationForm::kMdh) {
      Remove(row, "alpha_deg");
      Remove(row, "q_deg");
      Set(row, "alpha", Format(origin.r[0]));
      Set(row, "q", Format(origin.r[1]));
      Set(row, "a", Format(origin.t[0]));
      Set(row, "d", Format(origin.t[2]));
      return;
    }
    SetPose(row, link.origin, origin);
  }

  /// Writes an entry of the file's "frame", or of a chain's "frames".
  void WriteFrame(const PrintedLink& frame, const PrintedOrigin& origin) {
    std::optional<Entry> entry = FindIn(root_["frame"].as_array(), "frame.", "name", frame.name, false);
    if (!entry) entry = Look("frames", frame.name);
    if (!entry) Refuse("frame " + frame.name + " must be written by hand");
    SetPose(*entry, frame.origin, origin);
  }

  void SetPose(const Entry& entry, const PrintedOrigin& before, const PrintedOrigin& origin) {
    if (before.t != origin.t) Set(entry, "xyz", JoinVector(origin.t));
    if (!IsTurned(before, origin)) return;
    Remove(entry, "rpy_deg");
    Set(entry, "rpy", JoinVector(Vector3d(origin.r.head<3>())));
  }

  void WriteBody(const PrintedLink& before, const PrintedLink& after) {
    const Entry entry = Find("links", before.name);
    RefuseIf(!entry.table->contains("mass") || !after.inertial, before, "its link");
    Set(entry, "mass", Format(after.inertial->mass.value));
    Set(entry, "com", JoinVector(after.inertial->origin.t));
    Set(entry, "inertia", JoinVector(CalcInertia(*after.inertial)));
  }

  std::string source_, text_;
  toml::table root_;
  std::vector<std::string> assignments_;
};

}  // namespace

std::string WriteTable(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after) {
  return TableRepair(file, before, after).Write();
}

}  // namespace dexcheck
