#include "harness/comparison/constant_checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/rigid_body.h"
#include "harness/base/worst.h"
#include "harness/comparison/description_match.h"
#include "harness/descriptions/constant_table.h"
#include "harness/descriptions/random_states.h"
#include "harness/descriptions/robot_description.h"

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

}  // namespace

StatedConstants ReadStated(const RobotDescription& robot, const RobotSpec& reference) {
  const RobotModel model(robot.spec);
  const std::vector<int> order = MatchJoints(reference, robot.spec);
  const StatedConstants all = ReadStated(model);
  StatedConstants stated{
      std::filesystem::path(robot.spec.source).filename().string(), {}, {all.masses[0]}, {}};
  if (robot.states_gravity) stated.gravity = all.gravity;
  for (const int joint : order) {
    if (joint < 0) {
      stated.masses.push_back(0.0);
      stated.joints.emplace_back();
      continue;
    }
    const auto i = static_cast<size_t>(joint);
    const DescribedJoint& own = robot.joints[i];
    stated.masses.push_back(all.masses[i + 1]);
    StatedConstants::OfJoint& one = stated.joints.emplace_back(all.joints[i]);
    for (size_t k = 0; k < one.numbers.size(); ++k) {
      if (!(own.*ListDescribedConstants()[k].states)) one.numbers[k].reset();
    }
    if (!own.states_range) one.range.reset();
    if (one.coupling) one.coupling->leader = IndexOf(order, one.coupling->leader);
    one.forces = own.forces;
    one.wheel_radius = FindWheelRadius(robot, joint);
  }
  return stated;
}

namespace {

MechanismComparison Compare(const RobotModel& model, const RobotDescription& a, const RobotDescription& b,
                            ConstantChecks* result) {
  return {model, ReadStated(a, a.spec), ReadStated(b, a.spec), result};
}

/// Returns the least inertia that each velocity of a robot moves, of M_jj at some states.
VectorXd FindLeastInertia(const RobotModel& model) {
  constexpr int kStates = 20;
  ModelTerms terms(model);
  StateSource source(model, {}, 1);
  VectorXd q = VectorXd::Zero(model.num_positions());
  VectorXd inertia;
  for (int i = 0; i < kStates; ++i) {
    source.DrawPositions(&q);
    terms.SetState(q, VectorXd::Zero(model.num_velocities()));
    terms.CalcDynamics();
    const VectorXd diagonal = terms.M().diagonal();
    inertia = i == 0 ? diagonal : inertia.cwiseMin(diagonal).eval();
  }
  return inertia;
}

/// A check's quantity, its components, and its unit for hinges and for slides.
struct QuantityWords {
  const char* check;
  const char* name;
  const char* unit;
  const char* prismatic_unit;
  std::array<const char*, 9> components = {};
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
    {"joint_coupling", "coupling", "", "", {"leader", "multiplier", "offset"}},
    {"motor_limit", "motor's limit", "N m", "N"},
    {"motor_gain", "motor's gain", "", ""},
    {"disable_flag", "switched off by <flag>", "", ""},
    {"enable_flag", "switched on by <flag>", "", ""},
    {"fluid", "medium", "", ""},
    {"object_mass", "mass", "kg", "kg"},
    {"object_inertia",
     "inertia",
     "kg m^2",
     "kg m^2",
     {"Ixx", "Ixy", "Ixz", "Iyx", "Iyy", "Iyz", "Izx", "Izy", "Izz"}},
    {"wheel_radius", "wheel radius", "m", "m"},
    {"wheel_distance", "distance of the wheels", "m", "m"},
    {"axle_position", "place of the axle", "m", "m"},
    {"wheel_mass", "mass", "kg", "kg"},
    {"wheel_spin_inertia", "spin inertia", "kg m^2", "kg m^2"}};

const QuantityWords* FindWords(const std::string& check) {
  return FindIn(kQuantities, std::string_view(check), &QuantityWords::check);
}

}  // namespace

std::string NameQuantity(const std::string& check) {
  const QuantityWords* const words = FindWords(check);
  return words != nullptr ? words->name : check;
}

std::string NameComponent(const ConstantFinding& finding) {
  const QuantityWords* const words = FindWords(finding.check);
  const bool has =
      words != nullptr && finding.entry >= 0 && finding.entry < static_cast<int>(words->components.size());
  const char* const name = has ? words->components[static_cast<size_t>(finding.entry)] : nullptr;
  return name != nullptr ? name : "";
}

std::string UnitOf(const ConstantFinding& finding, const RobotModel* model) {
  const QuantityWords* const words = FindWords(finding.check);
  if (words == nullptr || finding.entry < 0) return "";
  if (finding.location.kind != Location::Kind::kJoint) return words->unit;
  if (model == nullptr) return std::string_view(words->unit) == words->prismatic_unit ? words->unit : "";
  const bool is_prismatic = model->joint(finding.location.first).type == JointType::kPrismatic;
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

void StatedConstants::LeaveOut(const std::vector<std::string>& ignore) {
  for (OfJoint& joint : joints) {
    for (size_t k = 0; k < joint.numbers.size(); ++k) {
      if (Contains(ignore, ListDescribedConstants()[k].word)) joint.numbers[k].reset();
    }
    if (Contains(ignore, "coupling")) joint.coupling.reset();
  }
}

StatedConstants ReadStated(const RobotModel& model) {
  StatedConstants stated{model.spec().source, model.gravity(), {model.base_with_wheels().mass}, {}};
  for (const Joint& joint : model.joints()) {
    stated.masses.push_back(joint.body.mass);
    StatedConstants::OfJoint& one = stated.joints.emplace_back();
    for (const DescribedConstant& constant : ListDescribedConstants())
      one.numbers.emplace_back(joint.*constant.value);
    one.range = {joint.lower, joint.upper};
    one.coupling = joint.coupling;
  }
  return stated;
}

void MechanismComparison::CompareShared() {
  for (int k = 0; a_.gravity && b_.gravity && k < 3; ++k)
    Compare("gravity_vector", {}, (*a_.gravity)[k], (*b_.gravity)[k], a_.gravity->norm());
  for (size_t i = model_.base().type == BaseType::kFixed ? 1 : 0; i < a_.masses.size(); ++i)
    Compare("link_mass", AtLink(static_cast<int>(i) - 1), a_.masses[i], b_.masses[i]);
  for (size_t k = 0; k < ListDescribedConstants().size(); ++k) {
    for (size_t i = 0; i < a_.joints.size(); ++i) {
      const std::optional<double>&own = a_.joints[i].numbers[k], &other = b_.joints[i].numbers[k];
      if (own && other)
        Compare(ListDescribedConstants()[k].check, AtJoint(static_cast<int>(i)), *own, *other);
    }
  }
  for (size_t i = 0; i < a_.joints.size(); ++i) {
    const auto &own = a_.joints[i].range, &other = b_.joints[i].range;
    for (size_t k = 0; own && other && k < 2; ++k)
      Compare("joint_range", AtJoint(static_cast<int>(i)), (*own)[k], (*other)[k]);
  }
}

void MechanismComparison::AddOneSided() {
  std::optional<VectorXd> inertia;
  for (size_t k = 0; k < ListDescribedConstants().size(); ++k) {
    const DescribedConstant& constant = ListDescribedConstants()[k];
    for (size_t i = 0; i < a_.joints.size(); ++i) {
      const std::optional<double>&own = a_.joints[i].numbers[k], &other = b_.joints[i].numbers[k];
      const double value = own ? *own : other.value_or(0.0);
      if (own.has_value() == other.has_value() || value == 0.0) continue;
      // An effect is largest where least inertia is moved.
      if (!inertia) inertia = FindLeastInertia(model_);
      const auto joint = static_cast<int>(i);
      const double least = inertia
                               ->segment(model_.num_base_velocities() + model_.dof(joint),
                                         CountVelocities(JointOf(joint).type))
                               .minCoeff();
      result_.Add({constant.check, DescribeWhere(AtJoint(joint)), own.value_or(0.0), other.value_or(0.0),
                   AtJoint(joint), 0,
                   "only " + (own ? a_ : b_).file + " states it" +
                       constant.describe_effect(JointOf(joint), value, least)});
    }
  }
}

/// Solves couplings for the joint that the other side couples: q1 = 2 q2 says what q2 = q1 / 2 says.
static void AlignCouplings(const StatedConstants& other, StatedConstants* stated) {
  for (size_t i = 0; i < stated->joints.size(); ++i) {
    const std::optional<JointCoupling> own = stated->joints[i].coupling;
    if (!own || own->leader < 0 || own->multiplier == 0.0 || other.joints[i].coupling) continue;
    const auto leader = static_cast<size_t>(own->leader);
    const std::optional<JointCoupling>& there = other.joints[leader].coupling;
    if (!there || there->leader != static_cast<int>(i) || stated->joints[leader].coupling) continue;
    stated->joints[leader].coupling = {static_cast<int>(i), 1.0 / own->multiplier,
                                       -own->offset / own->multiplier};
    stated->joints[i].coupling.reset();
  }
}

void MechanismComparison::CompareCouplings(bool by_engine) {
  constexpr const char* kCheck = "joint_coupling";
  AlignCouplings(a_, &b_);
  std::vector<std::string> only_there;
  for (int i = 0; i < model_.num_joints(); ++i) {
    const auto &own = a_.joints[static_cast<size_t>(i)].coupling,
               &other = b_.joints[static_cast<size_t>(i)].coupling;
    if (own && other) {
      Compare(kCheck, AtJoint(i), own->leader, other->leader);
      Compare(kCheck, AtJoint(i), own->multiplier, other->multiplier);
      Compare(kCheck, AtJoint(i), own->offset, other->offset);
    } else if (other && by_engine) {
      only_there.push_back(JointOf(i).name);
    } else if (own || other) {
      result_.Add(
          {kCheck, DescribeWhere(AtJoint(i)), own ? own->multiplier : 0.0, other ? other->multiplier : 0.0,
           AtJoint(i), 1,
           by_engine ? "only " + a_.file + " states it: it follows " + JointOf(own->leader).name : ""});
    }
  }
  if (!only_there.empty())
    result_.not_compared.push_back("coupled joints: only the MJCF couples " + JoinNames(only_there) +
                                   "; terms are compared with all joints free");
}

void MechanismComparison::CompareMotorsAndWheels() {
  for (size_t i = 0; i < a_.joints.size(); ++i) {
    const StatedConstants::OfJoint &own = a_.joints[i], &other = b_.joints[i];
    const Location at = AtJoint(static_cast<int>(i));
    if (own.forces && other.forces) {
      // A limit that is the same both ways is one number.
      const auto is_even = [](const StatedForces& forces) { return forces.lower == -forces.upper; };
      if (!is_even(*own.forces) || !is_even(*other.forces))
        Compare("motor_limit", at, own.forces->lower, other.forces->lower);
      Compare("motor_limit", at, own.forces->upper, other.forces->upper);
    }
    if (own.wheel_radius > 0.0 && other.wheel_radius > 0.0)
      Compare("wheel_radius", at, own.wheel_radius, other.wheel_radius);
  }
}

ConstantChecks CheckConstants(const RobotDescription& a, const RobotDescription& b) {
  const RobotModel model(a.spec);
  ConstantChecks result;
  MechanismComparison comparison = Compare(model, a, b, &result);
  comparison.CompareShared();
  comparison.CompareCouplings(/*by_engine=*/false);
  comparison.CompareMotorsAndWheels();
  comparison.AddOneSided();
  return result;
}

void CheckMotorsAndWheels(const RobotDescription& a, const RobotDescription& b, ConstantChecks* constants) {
  const RobotModel model(a.spec);
  Compare(model, a, b, constants).CompareMotorsAndWheels();
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
    const DescribedPart* const other = FindIn(b.parts, part.name, &DescribedPart::name);
    if (other == nullptr) continue;
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
    const int other = IndexOf(b.spec.joints, a.spec.joints[i].name, &Joint::name);
    if (other < 0) continue;
    const double own = a.joints[i].velocity_limit,
                 there = b.joints[static_cast<size_t>(other)].velocity_limit;
    if (own > 0.0 && there > 0.0 && differs(own, there))
      limits.push_back(fmt::format("{} ({:.6g} against {:.6g})", a.spec.joints[i].name, own, there));
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

namespace {

/// Radius of gyration, m.
double CalcGyration(const MassProperties& body) {
  return std::sqrt(body.inertia.trace() / (2.0 * body.mass));
}

}  // namespace

ConstantChecks CompareBodies(const RobotDescription& a, const RobotDescription& b,
                             const std::vector<Pose>& X_ab) {
  ConstantChecks result;
  const RobotModel model(a.spec);
  ConstantComparison comparison(model, &result);
  const auto compare = [&](int link, const MassProperties& own, const MassProperties& other) {
    if (own.mass <= 0.0 || other.mass <= 0.0) return;
    const double length = Worst(CalcGyration(own), own.com.norm(), other.com.norm());
    for (int k = 0; k < 3; ++k)
      comparison.Compare("link_com", AtLink(link), own.com[k], other.com[k], length);
    const Vector6d I = ToEntries(own.inertia), I_other = ToEntries(other.inertia);
    for (int k = 0; k < 6; ++k)
      comparison.Compare("link_inertia", AtLink(link), I[k], I_other[k], Worst(MaxAbs(I), MaxAbs(I_other)));
  };
  if (a.spec.base.type == BaseType::kFloating) compare(-1, a.spec.base.body, b.spec.base.body);
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  const std::vector<JointInLinkFrames> rows_a = ListJointsInLinkFrames(a);
  const std::vector<JointInLinkFrames> rows_b = ListJointsInLinkFrames(b);
  for (size_t i = 0; i < rows_a.size(); ++i) {
    if (b_of_a[i] < 0) continue;
    const MassProperties& other = rows_b[static_cast<size_t>(b_of_a[i])].body;
    compare(static_cast<int>(i), rows_a[i].body, X_ab.empty() ? other : ExpressIn(other, X_ab[i]));
  }
  return result;
}

void NameCompiledChanges(const std::vector<CompiledChange>& changes,
                         const std::array<const RobotDescription*, 2>& robots, size_t side,
                         ConstantChecks* constants, std::vector<std::string>* notes) {
  constexpr double kSame = 0.01;  // of what the text states, which the other file prints with other digits
  const RobotDescription& own = *robots[side];
  const RobotDescription& other = *robots[1 - side];
  const std::string file = std::filesystem::path(own.spec.source).filename().string();
  const std::vector<int> match = MatchJoints(own.spec, other.spec);
  std::map<std::string, std::pair<std::string, int>> first_of;  // by setting, and how many more
  for (const CompiledChange& change : changes) {
    const bool is_mass = change.stated.size() == 1;
    const std::string effect =
        fmt::format("{} of {}'s compiler changed the {} of {} from {:.6g} to {:.6g} {}", change.setting, file,
                    is_mass ? "mass" : "moments of inertia", change.body, fmt::join(change.stated, ", "),
                    fmt::join(change.made, ", "), is_mass ? "kg" : "kg m^2");
    const auto [line, is_new] = first_of.emplace(change.setting, std::pair(effect, 0));
    line->second.second += is_new ? 0 : 1;
    const DescribedPart* const part = FindIn(own.parts, change.body, &DescribedPart::name);
    if (part == nullptr) continue;
    const int joint_there = part->joint < 0 ? -1 : match[static_cast<size_t>(part->joint)];
    if (part->joint >= 0 && joint_there < 0) continue;
    const int joint_first = side == 0 ? part->joint : joint_there;
    const std::string where = "link " + LinkOf(robots[0]->spec, joint_first);
    if (is_mass) {
      for (ConstantFinding& finding : constants->findings) {
        if (finding.check == "link_mass" && finding.where == where) finding.effect = effect;
      }
      continue;
    }
    const Vector3d stated(change.stated.data()), made(change.made.data());
    const Vector3d there = CalcMoments(BodyOf(other.spec, joint_there).inertia);
    const double apart = (there - stated).norm();
    if (apart > kSame * stated.norm() || apart >= (there - made).norm()) continue;
    Eigen::Index k = 0;
    for (const Eigen::Index i : {1, 2}) {
      if (std::abs(made[i] - stated[i]) > std::abs(made[k] - stated[k])) k = i;
    }
    constants->Add({"compiled_inertia", where, side == 0 ? made[k] : stated[k],
                    side == 0 ? stated[k] : made[k], AtLink(joint_first), static_cast<int>(k), effect});
  }
  for (const auto& [setting, line] : first_of)
    notes->push_back(line.first + (line.second > 0 ? fmt::format(", and {} more", line.second) : ""));
}

}  // namespace dexcheck
