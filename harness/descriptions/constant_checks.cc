#include "harness/descriptions/constant_checks.h"

#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <utility>

#include "harness/descriptions/constant_table.h"
#include "harness/descriptions/description_match.h"

namespace dexcheck {
namespace {

/// Two descriptions, in what both state.
class DescriptionConstants : public ConstantComparison {
 public:
  DescriptionConstants(const RobotModel& model, const RobotDescription& a, const RobotDescription& b,
                       ConstantChecks* result)
      : ConstantComparison(model, result), a_(a), b_(b), b_of_a_(MatchJoints(a.spec, b.spec)) {}

  void Run() {
    if (a_.states_gravity && b_.states_gravity) CompareGravity(b_.spec.gravity);
    const RobotModel other(b_.spec);
    CompareMasses([&](int link) { return link < 0 ? other.base_with_wheels().mass : Other(link).body.mass; });
    for (const DescribedConstant& constant : ListDescribedConstants())
      CompareStated(constant.check, constant.states, {constant.value});
    CompareStated("joint_range", &DescribedJoint::states_range, {&Joint::lower, &Joint::upper});
    for (int i = 0; i < model_.num_joints(); ++i) CompareCoupling(i, JointOf(i).coupling, Other(i).coupling);
  }

 private:
  [[nodiscard]] const Joint& Other(int joint) const {
    return b_.spec.joints[static_cast<size_t>(b_of_a_[static_cast<size_t>(joint)])];
  }
  void CompareStated(const char* check, bool DescribedJoint::*states,
                     std::initializer_list<double Joint::*> numbers) {
    for (int i = 0; i < model_.num_joints(); ++i) {
      const auto own = static_cast<size_t>(i);
      if (!(a_.joints[own].*states) || !(b_.joints[static_cast<size_t>(b_of_a_[own])].*states)) continue;
      for (double Joint::*const number : numbers)
        Compare(check, AtJoint(i), JointOf(i).*number, Other(i).*number);
    }
  }
  void CompareCoupling(int joint, const std::optional<JointCoupling>& own,
                       const std::optional<JointCoupling>& other) {
    if (own && other) {
      CompareCouplings(joint, *own, b_of_a_[static_cast<size_t>(own->leader)], *other);
    } else if (own || other) {
      AddCoupling(joint, own ? own->multiplier : 0.0, other ? other->multiplier : 0.0, "");
    }
  }

  const RobotDescription& a_;
  const RobotDescription& b_;
  std::vector<int> b_of_a_;
};

/// A check's quantity, its components, and its unit for hinges and for slides.
struct QuantityWords {
  const char* check;
  const char* name;
  const char* unit;
  const char* prismatic_unit;
  std::array<const char*, 6> components = {};
};

constexpr QuantityWords kQuantities[] = {
    {"gravity_vector", "gravity", "m/s^2", "m/s^2", {"x", "y", "z"}},
    {"link_mass", "mass", "kg", "kg"},
    {"link_com", "centre of mass", "m", "m", {"x", "y", "z"}},
    {"link_inertia", "inertia", "kg m^2", "kg m^2", {"Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"}},
    {"joint_axis", "axis", "", ""},
    {"frame_pose", "pose", "", ""},
    {"joint_range", "range", "rad", "m", {"lower", "upper"}},
    {"joint_damping", "damping", "N m s/rad", "N s/m"},
    {"joint_dry_friction", "dry friction", "N m", "N"},
    {"joint_armature", "armature", "kg m^2", "kg"},
    {"joint_coupling", "coupling", "", "", {"leader", "multiplier", "offset"}}};

const QuantityWords* FindWords(const std::string& check) {
  const auto* const found = std::ranges::find(kQuantities, std::string_view(check), &QuantityWords::check);
  return found == std::end(kQuantities) ? nullptr : found;
}

}  // namespace

std::string NameQuantity(const std::string& check) {
  const QuantityWords* const words = FindWords(check);
  return words != nullptr ? words->name : check;
}

std::string NameComponent(const std::string& check, int entry) {
  const QuantityWords* const words = FindWords(check);
  const bool has = words != nullptr && entry >= 0 && entry < static_cast<int>(words->components.size());
  const char* const name = has ? words->components[static_cast<size_t>(entry)] : nullptr;
  return name != nullptr ? name : "";
}

std::string UnitOf(const std::string& check, bool is_prismatic) {
  const QuantityWords* const words = FindWords(check);
  if (words == nullptr) return "";
  return is_prismatic ? words->prismatic_unit : words->unit;
}

CheckRecord* ConstantChecks::Define(const std::string& check) {
  auto record = std::ranges::find(records, check, &CheckRecord::name);
  if (record == records.end()) {
    record = records.insert(record, CheckRecord{});
    record->name = check;
    record->bound = kConstantRounding;
  }
  return &*record;
}

void ConstantChecks::Add(ConstantFinding finding) {
  const double size = std::max(std::abs(finding.model), std::abs(finding.engine));
  Define(finding.check)
      ->Compare(finding.model, finding.engine, size > 0.0 ? size : 1.0, finding.location, -1);
  findings.push_back(std::move(finding));
}

ConstantChecks CheckConstants(const RobotDescription& a, const RobotDescription& b) {
  const RobotModel model(a.spec);
  ConstantChecks result;
  DescriptionConstants(model, a, b, &result).Run();
  return result;
}

void JudgeByTolerance(double tolerance, std::vector<CheckRecord>* records) {
  for (CheckRecord& record : *records) {
    record.bound = std::max(record.bound, tolerance);
    record.failed = !(record.worst <= record.bound);
    // Where the narrower bound was left first says nothing now.
    if (record.failed) record.first_failure = record.where;
  }
}

void JudgeByTolerance(double tolerance, ConstantChecks* constants) {
  JudgeByTolerance(tolerance, &constants->records);
  std::erase_if(constants->findings, [&](const ConstantFinding& finding) {
    const double size = std::max(std::abs(finding.model), std::abs(finding.engine));
    const bool is_within = std::abs(finding.model - finding.engine) <= tolerance * size;
    const bool check_holds = std::ranges::any_of(constants->records, [&](const CheckRecord& record) {
      return record.name == finding.check && !record.failed;
    });
    return is_within || check_holds;
  });
}

}  // namespace dexcheck
