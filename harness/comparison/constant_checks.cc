#include "harness/comparison/constant_checks.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <utility>

#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/comparison/description_match.h"
#include "harness/descriptions/constant_table.h"

namespace dexcheck {
namespace {

/// Radius of the round shape that turns about its joint's axis, m; 0 of a link that is no wheel.
double FindWheelRadius(const RobotDescription& robot, int joint) {
  constexpr double kSamePlace = 1e-6;  // m, and of the axes' directions
  const Joint& own = robot.spec.joints[static_cast<size_t>(joint)];
  if (own.type != JointType::kRevolute || robot.joints[static_cast<size_t>(joint)].states_range) return 0.0;
  if (robot.spec.base.type == BaseType::kFixed) return 0.0;
  if (std::ranges::any_of(robot.spec.joints, [&](const Joint& next) { return next.parent == joint; }))
    return 0.0;
  double radius = 0.0;
  for (const DescribedPart& part : robot.parts) {
    if (part.joint != joint) continue;
    for (const DescribedShape& shape : part.shapes) {
      const Vector3d center = part.X_iL * (0.5 * (shape.low + shape.high));
      const Vector3d axis = part.X_iL.linear() * shape.axis;
      if (center.head<2>().norm() < kSamePlace && axis.head<2>().norm() < kSamePlace)
        radius = Worst(radius, shape.radius);
    }
  }
  return radius;
}

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
    CompareMotorsAndWheels();
  }

  void CompareMotorsAndWheels() {
    for (int i = 0; i < model_.num_joints(); ++i) {
      const auto own = static_cast<size_t>(i);
      if (b_of_a_[own] < 0) continue;
      const auto other = static_cast<size_t>(b_of_a_[own]);
      CompareForces(i, a_.joints[own].forces, b_.joints[other].forces);
      const double radius = FindWheelRadius(a_, i);
      const double other_radius = FindWheelRadius(b_, b_of_a_[own]);
      if (radius > 0.0 && other_radius > 0.0) Compare("wheel_radius", AtJoint(i), radius, other_radius);
    }
  }

 private:
  /// A limit that is the same both ways is one number.
  void CompareForces(int joint, const std::optional<StatedForces>& own,
                     const std::optional<StatedForces>& other) {
    if (!own || !other) return;
    const auto is_even = [](const StatedForces& forces) { return forces.lower == -forces.upper; };
    if (!is_even(*own) || !is_even(*other)) Compare("motor_limit", AtJoint(joint), own->lower, other->lower);
    Compare("motor_limit", AtJoint(joint), own->upper, other->upper);
  }
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
  const double size = Worst(std::abs(finding.model), std::abs(finding.engine));
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

void CheckMotorsAndWheels(const RobotDescription& a, const RobotDescription& b, ConstantChecks* constants) {
  const RobotModel model(a.spec);
  DescriptionConstants(model, a, b, constants).CompareMotorsAndWheels();
}

std::vector<std::string> CompareShapes(const RobotDescription& a, const RobotDescription& b) {
  constexpr double kSame = 1e-3;  // of the larger volume
  const auto sum = [](const DescribedPart& part) {
    double volume = 0.0;
    for (const DescribedShape& shape : part.shapes) volume += shape.volume;
    return volume;
  };
  std::vector<std::string> differing;
  for (const DescribedPart& part : a.parts) {
    const auto other = std::ranges::find(b.parts, part.name, &DescribedPart::name);
    if (other == b.parts.end()) continue;
    const double volume = sum(part), there = sum(*other);
    if (volume > 0.0 && there > 0.0 && std::abs(volume - there) > kSame * Worst(volume, there))
      differing.push_back(fmt::format("{} ({:.4g} against {:.4g} m^3)", part.name, volume, there));
  }
  if (differing.empty()) return {};
  return {"shapes: their volume differs at " + JoinNames(differing)};
}

std::vector<std::string> CompareWithoutEffect(const RobotDescription& a, const RobotDescription& b) {
  constexpr double kSame = 1e-3;  // of the larger number
  constexpr double kNear = 1e-4;  // m; files print centres of mass to a tenth of a millimetre
  const auto differs = [](double x, double y) { return std::abs(x - y) > kSame * Worst(x, y); };
  std::vector<std::string> lines, limits;
  for (size_t i = 0; i < a.joints.size(); ++i) {
    const auto other = std::ranges::find(b.spec.joints, a.spec.joints[i].name, &Joint::name);
    if (other == b.spec.joints.end()) continue;
    const double own = a.joints[i].velocity_limit;
    const double there = b.joints[static_cast<size_t>(other - b.spec.joints.begin())].velocity_limit;
    if (own > 0.0 && there > 0.0 && differs(own, there))
      limits.push_back(fmt::format("{} ({:.6g} against {:.6g})", other->name, own, there));
  }
  if (!limits.empty()) lines.push_back("velocity limits: " + JoinNames(limits));

  const Base &base = a.spec.base, &of_b = b.spec.base;
  if (base.type != BaseType::kFixed || of_b.type != BaseType::kFixed) return lines;
  if (!(base.body.mass > 0.0) || !(of_b.body.mass > 0.0)) return lines;
  const std::string what = "base with all that is welded to it: ";
  if (differs(base.body.mass, of_b.body.mass)) {
    lines.push_back(fmt::format("{}mass {:.6g} against {:.6g} kg", what, base.body.mass, of_b.body.mass));
  } else if (const double apart = (base.X_B0 * base.body.com - of_b.X_B0 * of_b.body.com).norm();
             apart > kNear + kSame * base.body.com.norm()) {
    lines.push_back(fmt::format("{}centre of mass, {:.4g} m apart", what, apart));
  }
  return lines;
}

void JudgeByTolerance(double tolerance, std::vector<CheckRecord>* records) {
  for (CheckRecord& record : *records) {
    record.bound = Worst(record.bound, tolerance);
    record.failed = !(record.worst <= record.bound);
    // The place that first exceeded the narrower bound means nothing now.
    if (record.failed) record.first_failure = record.where;
  }
}

void JudgeByTolerance(double tolerance, ConstantChecks* constants) {
  JudgeByTolerance(tolerance, &constants->records);
  std::erase_if(constants->findings, [&](const ConstantFinding& finding) {
    const double size = Worst(std::abs(finding.model), std::abs(finding.engine));
    const bool is_within = std::abs(finding.model - finding.engine) <= tolerance * size;
    const bool check_holds = std::ranges::any_of(constants->records, [&](const CheckRecord& record) {
      return record.name == finding.check && !record.failed;
    });
    return is_within || check_holds;
  });
}

}  // namespace dexcheck
