#include "harness/comparison/file_causes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "harness/base/worst.h"
#include "harness/comparison/description_match.h"
#include "harness/corrections/candidate_search.h"
#include "harness/corrections/link_match.h"

namespace dexcheck {
namespace {

// Units at hinges and at slides, by JointScalar.
constexpr const char* kUnits[][kNumJointScalars] = {
    {"N m s/rad", "N m", "kg m^2", "N m", "rad/s", "N m/rad", "rad", ""},
    {"N s/m", "N", "kg", "N", "m/s", "N/m", "m", ""}};

/// A number of a link or of the joint that moves it, as its file prints it.
struct NamedNumber {
  std::string quantity;  ///< "mass", "centre of mass x", "position z", "upper limit".
  std::string unit;      ///< Empty of a pure number.
  double value = 0.0;
};
void AddOrigin(const std::string& of, const char* position, const PrintedOrigin& origin,
               std::vector<NamedNumber>* numbers) {
  if (origin.form == RotationForm::kMdh) {
    numbers->insert(numbers->end(), {{"alpha", "rad", origin.r[0]},
                                     {"a", "m", origin.t[0]},
                                     {"q", "rad", origin.r[1]},
                                     {"d", "m", origin.t[2]}});
    return;
  }
  for (int k = 0; k < 3; ++k)
    numbers->push_back({fmt::format("{} {}", position, "xyz"[k]), "m", origin.t[k]});
  for (int k = 0; k < 4; ++k) {
    if (origin.form == RotationForm::kQuaternion)
      numbers->push_back({fmt::format("{}quaternion {}", of, "wxyz"[k]), "", origin.r[k]});
    if (k == 3) break;
    if (origin.form == RotationForm::kRollPitchYaw)
      numbers->push_back({of + kAngleNames[k], "rad", origin.r[k]});
    if (origin.form == RotationForm::kEuler)
      numbers->push_back({fmt::format("{}euler {}", of, k + 1), "rad", origin.r[k]});
  }
}

/// Lists all numbers that a link states; a rotation's are those of the file's own form.
std::vector<NamedNumber> NameNumbers(const PrintedLink& link) {
  std::vector<NamedNumber> numbers;
  const PrintedJoint& joint = link.joint;
  const bool is_slide = joint.kind == JointKind::kSlide;
  AddOrigin("", "position", link.origin, &numbers);
  for (int k = 0; k < 3 && joint.kind != JointKind::kFixed; ++k)
    numbers.push_back({fmt::format("axis {}", "xyz"[k]), "", joint.axis[k]});
  for (int k = 0; k < 3; ++k) {
    if (!joint.anchor.isZero())
      numbers.push_back({fmt::format("point of the axis {}", "xyz"[k]), "m", joint.anchor[k]});
  }
  for (const size_t k : {0U, 1U}) {
    if (joint.range)
      numbers.push_back(
          {k == 0 ? "lower limit" : "upper limit", is_slide ? "m" : "rad", (*joint.range)[k].value});
  }
  for (size_t k = 0; k < kNumJointScalars; ++k) {
    if (joint.scalars[k])
      numbers.push_back({NameSite(ToSite(static_cast<JointScalar>(k))), kUnits[is_slide ? 1 : 0][k],
                         joint.scalars[k]->value});
  }
  if (joint.mimic) {
    numbers.push_back({"mimic multiplier", "", joint.mimic->multiplier.value});
    numbers.push_back({"mimic offset", is_slide ? "m" : "rad", joint.mimic->offset.value});
  }
  if (!link.inertial) return numbers;
  numbers.push_back({"mass", "kg", link.inertial->mass.value});
  AddOrigin("inertial ", "centre of mass", link.inertial->origin, &numbers);
  for (int k = 0; k < 6; ++k)
    numbers.push_back({fmt::format("inertia {}", kInertiaNames[k]), "kg m^2", link.inertial->I[k]});
  return numbers;
}

/// Name of the vector or tensor that a number belongs to.
std::string NameVector(const std::string& quantity) { return quantity.substr(0, quantity.rfind(' ')); }

/// Numbers that the patches of an item change.
std::vector<FileChange> ListChanges(const PrintedRobot& robot, const CorrectionItem& item) {
  std::vector<FileChange> changes;
  for (const LinkPatch& patch : item.patches) {
    const PrintedLink& given = robot.link(patch.link);
    const std::vector<NamedNumber> before = NameNumbers(given), after = NameNumbers(patch.right);
    std::map<std::string, double> sizes;
    for (const auto* numbers : {&before, &after}) {
      for (const NamedNumber& number : *numbers) {
        double& size = sizes[NameVector(number.quantity)];
        size = Worst(size, std::abs(number.value));
      }
    }
    const auto add = [&](const NamedNumber& number, std::optional<double> value,
                         std::optional<double> repair) {
      constexpr double kRounding = 1e-12;
      const bool is_of_link = number.quantity == "mass" || number.quantity.starts_with("inerti") ||
                              number.quantity.starts_with("centre");
      const double size = sizes[NameVector(number.quantity)];
      if (repair && std::abs(*repair) <= kRounding * size) repair = 0.0;
      changes.push_back({NamePlace(given, is_of_link ? SiteKind::kMass : SiteKind::kPosition),
                         number.quantity, number.unit, value, repair, size});
    };
    for (const NamedNumber& number : after) {
      const NamedNumber* const was = FindIn(before, number.quantity, &NamedNumber::quantity);
      if (was == nullptr) add(number, std::nullopt, number.value);
      if (was != nullptr && was->value != number.value) add(number, was->value, number.value);
    }
    for (const NamedNumber& number : before) {
      if (!Contains(after, number.quantity, &NamedNumber::quantity)) add(number, number.value, std::nullopt);
    }
  }
  return changes;
}

}  // namespace

void LeaveOutUnstated(const std::vector<std::string>& ignore, PrintedRobot* robot) {
  constexpr std::pair<const char*, JointScalar> kWords[] = {{"damping", JointScalar::kDamping},
                                                            {"friction", JointScalar::kFriction},
                                                            {"armature", JointScalar::kArmature},
                                                            {"effort", JointScalar::kEffort}};
  for (PrintedLink& link : robot->links) {
    for (const auto& [word, scalar] : kWords) {
      if (Contains(ignore, word)) link.joint.scalars[static_cast<size_t>(scalar)].reset();
    }
    if (Contains(ignore, "coupling")) link.joint.mimic.reset();
    for (const JointScalar limit : {JointScalar::kEffort, JointScalar::kVelocity}) {
      std::optional<PrintedScalar>& number = link.joint.scalars[static_cast<size_t>(limit)];
      if (number && number->value == 0.0) number.reset();
    }
  }
}

namespace {

/// Makes frames of links that are frames on their link in the other robot.
void TakeFrames(const PrintedRobot& other, PrintedRobot* robot) {
  for (PrintedLink& link : robot->links) {
    link.is_frame = link.is_frame || (!Moves(link) && std::ranges::any_of(other.links, [&](const auto& one) {
                      return one.is_frame && one.name == link.name;
                    }));
  }
}

/// Takes out of a robot ranges of half a turn to both sides.
void LeaveOutHalfTurns(PrintedRobot* robot) {
  const auto is_end = [](const PrintedScalar& end, double half_turn) {
    return std::abs(end.value - half_turn) <= end.half + 1e-12;
  };
  for (PrintedLink& link : robot->links) {
    auto& range = link.joint.range;
    if (range && is_end((*range)[0], -kPi) && is_end((*range)[1], kPi)) range.reset();
  }
}

}  // namespace

void LeaveOutUnshared(PrintedRobot* a, PrintedRobot* b) {
  TakeFrames(*b, a);
  TakeFrames(*a, b);
  if (a->format != RobotFormat::kToml && b->format != RobotFormat::kToml) return;
  for (PrintedRobot* const robot : {a, b}) LeaveOutHalfTurns(robot);
}

bool IsExplained(const std::string& check, const CorrectionItem& cause) {
  using enum SiteKind;
  static const std::map<std::string, std::vector<SiteKind>> kKindsOfChecks = {
      {"link_mass", {kMass}},
      {"link_com", {kMass, kCom, kPosition, kRotation, kAxis, kAxisPoint}},
      {"link_inertia", {kMass, kCom, kInertia, kPosition, kRotation, kAxis, kAxisPoint}},
      {"compiled_inertia", {kInertia}},
      {"joint_axis", {kPosition, kRotation, kAxis, kAxisPoint}},
      {"frame_pose", {kPosition, kRotation, kAxis, kAxisPoint}},
      {"joint_range", {kRange}},
      {"joint_limited", {kRange}},
      {"joint_damping", {kDamping}},
      {"joint_armature", {kArmature}},
      {"joint_dry_friction", {kFriction}},
      {"joint_spring", {kStiffness, kSpringAngle}},
      {"joint_coupling", {kMimic}},
      {"equality_constraint", {kMimic, kConstraint}},
      {"motor_limit", {kEffort, kGear, kMotor}},
      {"motor_transmission", {kGear, kMotor}},
      {"motor_gain", {kMotor}},
      {"motor_bias", {kMotor}},
      {"gravity_vector", {kGravity}}};
  const auto kinds = kKindsOfChecks.find(check);
  return std::ranges::any_of(cause.sites, [&](const Site& site) {
    const bool is_of_tree = site.kind <= SiteKind::kType;
    return is_of_tree || (kinds != kKindsOfChecks.end() && Contains(kinds->second, site.kind));
  });
}

FileCauses FindCauses(PrintedRobot a, PrintedRobot b) {
  LeaveOutUnshared(&a, &b);
  FileCauses found{FindCorrections(a, b), {}, {}};
  const bool of_second = found.of_second;
  const bool is_in_reference =
      !found.items.empty() && std::ranges::all_of(found.items, [&](const CorrectionItem& item) {
        return item.in_second != of_second;
      });
  found.of_second = of_second != is_in_reference;
  found.file = (found.of_second ? b : a).source;
  found.reference = (found.of_second ? a : b).source;
  const auto describe = [&](CorrectionItem* item) {
    item->text = DescribeItem(*item, item->in_second == found.of_second ? "" : found.reference);
    item->changes = ListChanges(of_second ? b : a, *item);
  };
  for (CorrectionItem& item : found.items) {
    describe(&item);
    for (CorrectionItem& rival : item.rivals) describe(&rival);
  }
  return found;
}

void LeaveOutWithin(double tolerance, const std::function<bool(SiteKind)>& differs, FileCauses* causes) {
  std::erase_if(causes->items, [&](const CorrectionItem& item) {
    const bool is_within =
        !item.changes.empty() && std::ranges::all_of(item.changes, [&](const FileChange& change) {
          return change.value && change.repair &&
                 std::abs(*change.value - *change.repair) <= tolerance * change.size;
        });
    return is_within ||
           std::ranges::none_of(item.sites, [&](const Site& site) { return differs(site.kind); });
  });
  causes->agrees = causes->items.empty() && causes->unexplained.empty();
}

std::vector<std::string> ListLines(const FileCauses& causes) {
  std::vector<std::string> lines;
  for (size_t i = 0; i < causes.items.size(); ++i) {
    const CorrectionItem& cause = causes.items[i];
    lines.push_back(fmt::format("{}. {}; explains {:.3g} %", i + 1, cause.text, 100.0 * cause.explained));
    for (const CorrectionItem& other : cause.rivals) lines.push_back("   or, just as well: " + other.text);
  }
  for (const std::string& left : causes.unexplained) lines.push_back("not explained: " + left);
  return lines;
}

}  // namespace dexcheck
