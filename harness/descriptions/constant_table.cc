#include "harness/descriptions/constant_table.h"

#include <fmt/format.h>

#include <algorithm>

namespace dexcheck {
namespace {

using P = PartKind;
using I = Constant::Index;

std::string DescribeDamping(const Joint& joint, double value, double least_inertia) {
  return fmt::format(": the velocity of {} decays in {:.2g} s", joint.name, least_inertia / value);
}
std::string DescribeArmature(const Joint& joint, double value, double least_inertia) {
  return fmt::format(": M of {} grows by up to {:.2g} %", joint.name,
                     100.0 * value / (least_inertia - value));
}
std::string DescribeDryFriction(const Joint& joint, double value, double least_inertia) {
  return fmt::format(": {} is slowed by up to {:.2g} {}", joint.name, value / least_inertia,
                     joint.type != JointType::kPrismatic ? "rad/s^2" : "m/s^2");
}

constexpr DescribedConstant kDescribed[] = {
    {"joint_damping", "damping", &DescribedJoint::states_damping, &Joint::damping, &mjModel::dof_damping,
     DescribeDamping},
    {"joint_armature", "armature", &DescribedJoint::states_armature, &Joint::armature, &mjModel::dof_armature,
     DescribeArmature},
    {"joint_dry_friction", "friction", &DescribedJoint::states_dry_friction, &Joint::dry_friction,
     &mjModel::dof_frictionloss, DescribeDryFriction}};

bool HasSpring(const mjModel& m, int joint) { return m.jnt_stiffness[joint] != 0.0; }
bool HasLimit(const mjModel& m, int joint) { return m.jnt_limited[joint] != 0; }
bool LimitsControl(const mjModel& m, int motor) { return m.actuator_ctrllimited[motor] != 0; }
bool LimitsForce(const mjModel& m, int motor) { return m.actuator_forcelimited[motor] != 0; }

// A constant that is compared between two models alone has no neutral value.
constexpr Constant kConstants[] = {
    {"joint_damping", P::kJoint, "damping", &mjModel::dof_damping, I::kDof, 1, 0.0, nullptr, kFreeJoint},
    {"joint_armature", P::kJoint, "armature", &mjModel::dof_armature, I::kDof, 1, 0.0, nullptr, kFreeJoint},
    {"joint_limited", P::kJoint, "limited", &mjModel::jnt_limited, I::kPart, 1, 0.0, nullptr,
     kFreeJoint | kWheelJoint},
    {"joint_spring", P::kJoint, "stiffness", &mjModel::jnt_stiffness, I::kPart, 1, 0.0},
    {"joint_spring", P::kJoint, "springref", &mjModel::qpos_spring, I::kPosition, 1, {}, HasSpring},
    {"joint_dry_friction", P::kJoint, "frictionloss", &mjModel::dof_frictionloss, I::kDof, 1, 0.0, nullptr,
     kFreeJoint | kWheelJoint},
    {"joint_limit_margin", P::kJoint, "margin", &mjModel::jnt_margin, I::kPart, 1, 0.0, HasLimit},
    {"motor_transmission", P::kActuator, "transmission", &mjModel::actuator_trntype, I::kPart, 1,
     mjTRN_JOINT},
    {"motor_transmission", P::kActuator, "gear", &mjModel::actuator_gear, I::kPart, 6, 1.0},
    {"motor_dynamics", P::kActuator, "dyntype", &mjModel::actuator_dyntype, I::kPart, 1, mjDYN_NONE},
    {"motor_dynamics", P::kActuator, "dynprm", &mjModel::actuator_dynprm, I::kPart, mjNDYN},
    {"motor_gain", P::kActuator, "gaintype", &mjModel::actuator_gaintype, I::kPart, 1, mjGAIN_FIXED},
    {"motor_gain", P::kActuator, "gainprm", &mjModel::actuator_gainprm, I::kPart, mjNGAIN, 1.0},
    {"motor_bias", P::kActuator, "biastype", &mjModel::actuator_biastype, I::kPart, 1, mjBIAS_NONE},
    {"motor_bias", P::kActuator, "biasprm", &mjModel::actuator_biasprm, I::kPart, mjNBIAS},
    {"motor_limit", P::kActuator, "ctrlrange", &mjModel::actuator_ctrlrange, I::kPart, 2, {}, LimitsControl},
    {"motor_limit", P::kActuator, "forcerange", &mjModel::actuator_forcerange, I::kPart, 2, {}, LimitsForce},
    {"tendon_spring", P::kTendon, "stiffness", &mjModel::tendon_stiffness, I::kPart, 1, 0.0},
    {"tendon_spring", P::kTendon, "springlength", &mjModel::tendon_lengthspring, I::kPart, 2},
    {"tendon_damping", P::kTendon, "damping", &mjModel::tendon_damping, I::kPart, 1, 0.0},
    {"tendon_friction", P::kTendon, "frictionloss", &mjModel::tendon_frictionloss, I::kPart, 1, 0.0},
    {"tendon_limit", P::kTendon, "limited", &mjModel::tendon_limited, I::kPart, 1, 0.0},
    {"tendon_limit", P::kTendon, "range", &mjModel::tendon_range, I::kPart, 2},
    {"equality_constraint", P::kConstraint, "type", &mjModel::eq_type},
    {"equality_constraint", P::kConstraint, "active", kEqualityActive, I::kPart, 1, 0.0},
    {"equality_constraint", P::kConstraint, "data", &mjModel::eq_data, I::kPart, mjNEQDATA}};

/// First entry of a part's numbers in the array, and how many they are.
std::pair<int, int> FindNumbers(const Constant& constant, const mjModel& m, int part) {
  constexpr int kPositions[] = {7, 4, 1, 1};  // of a free joint, a ball, a slide, a hinge
  constexpr int kDofs[] = {6, 3, 1, 1};
  switch (constant.index) {
    case I::kPosition:
      return {m.jnt_qposadr[part], kPositions[m.jnt_type[part]]};
    case I::kDof:
      return {m.jnt_dofadr[part], kDofs[m.jnt_type[part]]};
    case I::kPart:
      break;
  }
  return {constant.count * part, constant.count};
}

}  // namespace

std::span<const Constant> ListConstants() { return kConstants; }
std::span<const DescribedConstant> ListDescribedConstants() { return kDescribed; }

std::vector<double> ReadConstant(const Constant& constant, const mjModel& m, int part) {
  const auto [first, count] = FindNumbers(constant, m, part);
  std::vector<double> numbers(static_cast<size_t>(count), 0.0);
  if (constant.applies != nullptr && !constant.applies(m, part)) return numbers;
  std::visit([&, at = first](auto array) { std::copy_n(m.*array + at, numbers.size(), numbers.begin()); },
             constant.array);
  return numbers;
}

void MakeIdle(PartKind kind, int id, unsigned role, mjModel* m) {
  for (const Constant& constant : ListConstants()) {
    if (constant.part != kind || (constant.roles & role) == 0 || !constant.neutral) continue;
    const auto [first, count] = FindNumbers(constant, *m, id);
    const int changed = constant.index == I::kPart ? 1 : count;
    std::visit(
        [&, at = first](auto array) {
          using Number = std::remove_pointer_t<std::remove_reference_t<decltype(m->*array)>>;
          std::fill_n(m->*array + at, changed, static_cast<Number>(*constant.neutral));
        },
        constant.array);
  }
}

int FindCouplingConstraint(const mjModel& engine, int joint) {
  for (int eq = 0; eq < engine.neq; ++eq) {
    if (engine.eq_type[eq] != mjEQ_JOINT || GetEqualityActive(engine)[eq] == 0) continue;
    if (engine.eq_obj1id[eq] != joint || engine.eq_obj2id[eq] < 0) continue;
    const mjtNum* a = engine.eq_data + mjNEQDATA * eq;
    if (a[2] == 0.0 && a[3] == 0.0 && a[4] == 0.0) return eq;
  }
  return -1;
}

std::optional<JointCoupling> FindEngineCoupling(const mjModel& engine, int joint) {
  JointCoupling found{joint, 1.0, 0.0};
  // Joints that follow one another in a circle have no leader.
  for (int count = 0; count <= engine.neq; ++count) {
    const int eq = FindCouplingConstraint(engine, found.leader);
    if (eq < 0) return count > 0 ? std::optional(found) : std::nullopt;
    // q1 - q1_0 = a0 + a1 (q2 - q2_0)
    const mjtNum* a = engine.eq_data + mjNEQDATA * eq;
    const int leader = engine.eq_obj2id[eq];
    const double q1_0 = engine.qpos0[engine.jnt_qposadr[found.leader]];
    const double q2_0 = engine.qpos0[engine.jnt_qposadr[leader]];
    found = {leader, found.multiplier * a[1], found.offset + found.multiplier * (a[0] + q1_0 - a[1] * q2_0)};
  }
  return std::nullopt;
}

}  // namespace dexcheck
