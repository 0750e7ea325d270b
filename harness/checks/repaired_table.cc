#include <toml++/toml.h>

#include <vector>

#include "controller/common/toml_reader.h"
#include "harness/checks/repaired_link.h"

namespace dexcheck {
namespace {

/// Assignments to keys of a parameter file.
class TableRepair : private FileRepair {
 public:
  explicit TableRepair(const DescriptionFile& file)
      : FileRepair(file), source_(file.path().string()), text_(file.text()), root_(toml::parse(text_)) {}

  std::string Write(const PrintedRobot& before, const PrintedRobot& after) {
    for (int i = 1; i < before.size(); ++i) {
      const RepairedLink link = {before.link(i), after.link(i)};
      const bool is_moved = link.IsMoved() || link.IsTurned();
      if (is_moved) WriteRow(link);
      if (link.HasOtherBody()) WriteBody(link);
      WriteJoint(link);
    }
    if (before.link(0).inertial && RepairedLink{before.link(0), after.link(0)}.HasOtherBody())
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

  /// The row, or the entry below `key`, of a joint or link of that name.
  [[nodiscard]] Entry Find(const char* key, const std::string& name) const {
    const toml::array* const chains = root_["chain"].as_array();
    for (size_t i = 0; chains != nullptr && i < chains->size(); ++i) {
      const toml::table& chain = *chains->get(i)->as_table();
      const std::string prefix = chain["prefix"].value_or(std::string());
      if (!name.starts_with(prefix)) continue;
      const std::string own = name.substr(prefix.size());
      const std::string begin = fmt::format("chain.{}.{}.", i, key);
      const bool states = chain.contains("convention");
      if (const toml::array* const rows = chain[key].as_array()) {
        for (size_t k = 0; k < rows->size(); ++k) {
          const toml::table* const row = rows->get(k)->as_table();
          if ((*row)["joint"].value_or(std::string()) == own) return {row, begin + std::to_string(k), states};
        }
      } else if (const toml::table* const entry = chain[key][own].as_table()) {
        return {entry, begin + own, states};
      }
    }
    Refuse(fmt::format("{} is not among the {} of a chain of its own", name, key));
  }

  void Set(const Entry& entry, const char* key, const std::string& value) {
    assignments_.push_back(entry.path + "." + key + "=" + value);
  }
  template <typename Vector>
  void SetList(const Entry& entry, const char* key, const Vector& values) {
    Set(entry, key, "[" + JoinRepaired(values, ", ") + "]");
  }
  void Remove(const Entry& entry, const char* key) {
    if (entry.table->contains(key)) assignments_.push_back(entry.path + "." + key + "-=");
  }

  void WriteRow(const RepairedLink& link) {
    const Entry row = Find("rows", link.before.joint.name);
    PrintedOrigin origin = link.after.origin;
    if (link.before.origin.form == RotationForm::kMdh) FindRow(link.before.origin.X_before, &origin);
    RefuseIf(origin.form != link.before.origin.form || row.states_convention, link.before, "its row");
    if (origin.form == RotationForm::kMdh) {
      Remove(row, "alpha_deg");
      Remove(row, "q_deg");
      Set(row, "alpha", FormatRepaired(origin.r[0]));
      Set(row, "q", FormatRepaired(origin.r[1]));
      Set(row, "a", FormatRepaired(origin.t[0]));
      Set(row, "d", FormatRepaired(origin.t[2]));
      return;
    }
    Remove(row, "rpy_deg");
    SetList(row, "xyz", origin.t);
    SetList(row, "rpy", origin.r.head<3>());
  }

  /// Gives a pose the form of a row of modified parameters behind X_before, if it has one.
  static void FindRow(const Pose& X_before, PrintedOrigin* origin) {
    constexpr double kSame = 1e-9;
    const Pose X = X_before.inverse() * origin->CalcPose();
    const Matrix3d R = X.linear();  // Rot(x, alpha) Rot(z, q)
    const double alpha = std::atan2(-R(1, 2), R(2, 2));
    const double d = Vector3d(0.0, -std::sin(alpha), std::cos(alpha)).dot(X.translation());
    PrintedOrigin row;
    row.form = RotationForm::kMdh;
    row.X_before = X_before;
    row.r.head<2>() << alpha, std::atan2(-R(0, 1), R(0, 0));
    row.t << X.translation().x(), 0.0, d;
    if (row.CalcPose().isApprox(origin->CalcPose(), kSame)) *origin = row;
  }

  void WriteBody(const RepairedLink& link) {
    const Entry entry = Find("links", link.before.name);
    RefuseIf(!entry.table->contains("mass") || !link.after.inertial, link.before, "its link");
    const PrintedInertial& body = *link.after.inertial;
    Set(entry, "mass", FormatRepaired(body.mass.value));
    SetList(entry, "com", body.origin.t);
    SetList(entry, "inertia", link.CalcInertia());
  }

  void WriteJoint(const RepairedLink& link) {
    const PrintedJoint& joint = link.after.joint;
    const PrintedJoint& before = link.before.joint;
    RefuseIf(joint.name != before.name, link.before, "its name");
    RefuseIf(joint.kind != before.kind, link.before, "its type");
    RefuseIf(link.HasOtherMimic(), link.before, "its coupling");
    if (joint.axis != before.axis) SetList(Find("rows", joint.name), "axis", joint.axis);
    if (link.HasOtherRange()) {
      RefuseIf(!joint.range, link.before, "a range that is too much");
      const Entry entry = Find("joints", joint.name);
      Remove(entry, "range_deg");
      SetList(entry, "range", Vector2d((*joint.range)[0].value, (*joint.range)[1].value));
    }
    for (size_t k = 0; k < kNumJointScalars; ++k) {
      const std::optional<double> number = link.FindScalar(k);
      if (!number) continue;
      RefuseIf(kScalarAttributes[k].toml == nullptr, link.before,
               NameSite(ToSite(static_cast<JointScalar>(k))));
      Set(Find("joints", joint.name), kScalarAttributes[k].toml, FormatRepaired(*number));
    }
  }

  std::string source_, text_;
  toml::table root_;
  std::vector<std::string> assignments_;
};

}  // namespace

std::string RepairTable(const DescriptionFile& file, const PrintedRobot& before, const PrintedRobot& after) {
  return TableRepair(file).Write(before, after);
}

}  // namespace dexcheck
