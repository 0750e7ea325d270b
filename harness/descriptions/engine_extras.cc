#include "harness/descriptions/engine_extras.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "harness/descriptions/description_check.h"
#include "harness/descriptions/engine_coupling.h"
#include "harness/descriptions/join_names.h"
#include "harness/engine/engine.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

// Both sides read decimal numbers and form at most short sums and products of them.
constexpr double kRounding = 64.0 * std::numeric_limits<double>::epsilon();

bool AreSame(double a, double b) { return std::abs(a - b) <= kRounding * std::max(std::abs(a), std::abs(b)); }

/// One number of a part, and the check that it belongs to.
struct Number {
  const char* check;
  std::string where;
  double value;
};

/// A part of a model in numbers and in names of the parts that it refers to, in an order of its kind.
struct Part {
  std::vector<Number> numbers;
  std::vector<std::string> names;

  void Add(const char* check, const std::string& where, const mjtNum* values, int count) {
    for (int k = 0; k < count; ++k)
      numbers.push_back({check, count == 1 ? where : where + fmt::format("[{}]", k), values[k]});
  }
  void Add(const char* check, const std::string& where, double value) { Add(check, where, &value, 1); }
};

std::string NameOfTarget(const mjModel& m, int actuator) {
  const int* const targets = m.actuator_trnid + 2 * actuator;
  switch (m.actuator_trntype[actuator]) {
    case mjTRN_JOINT:
    case mjTRN_JOINTINPARENT:
      return NameOf(m, mjOBJ_JOINT, targets[0]);
    case mjTRN_TENDON:
      return NameOf(m, mjOBJ_TENDON, targets[0]);
    case mjTRN_SLIDERCRANK:
      return NameOf(m, mjOBJ_SITE, targets[0]) + " " + NameOf(m, mjOBJ_SITE, targets[1]);
    case mjTRN_SITE:
      return NameOf(m, mjOBJ_SITE, targets[0]);
    case mjTRN_BODY:
      return NameOf(m, mjOBJ_BODY, targets[0]);
    default:
      return "";
  }
}

Part ReadActuator(const mjModel& m, int i) {
  Part part;
  part.names.push_back(NameOfTarget(m, i));
  part.Add("motor_transmission", "transmission", m.actuator_trntype[i]);
  part.Add("motor_transmission", "gear", m.actuator_gear + 6 * i, 6);
  part.Add("motor_dynamics", "dyntype", m.actuator_dyntype[i]);
  part.Add("motor_dynamics", "dynprm", m.actuator_dynprm + mjNDYN * i, mjNDYN);
  part.Add("motor_gain", "gaintype", m.actuator_gaintype[i]);
  part.Add("motor_gain", "gainprm", m.actuator_gainprm + mjNGAIN * i, mjNGAIN);
  part.Add("motor_bias", "biastype", m.actuator_biastype[i]);
  part.Add("motor_bias", "biasprm", m.actuator_biasprm + mjNBIAS * i, mjNBIAS);
  return part;
}

bool IsPlainMotor(const mjModel& m, int i) {
  const int transmission = m.actuator_trntype[i];
  return (transmission == mjTRN_JOINT || transmission == mjTRN_JOINTINPARENT) &&
         m.actuator_dyntype[i] == mjDYN_NONE && m.actuator_gaintype[i] == mjGAIN_FIXED &&
         m.actuator_gainprm[mjNGAIN * i] == 1.0 && m.actuator_biastype[i] == mjBIAS_NONE &&
         m.actuator_gear[6 * i] != 0.0;
}

void MakePlainMotor(int i, mjModel* m) {
  m->actuator_trntype[i] = mjTRN_JOINT;
  m->actuator_dyntype[i] = mjDYN_NONE;
  m->actuator_gaintype[i] = mjGAIN_FIXED;
  m->actuator_gainprm[mjNGAIN * i] = 1.0;
  m->actuator_biastype[i] = mjBIAS_NONE;
  m->actuator_gear[6 * i] = 1.0;
}

Part ReadTendon(const mjModel& m, int i) {
  Part part;
  part.Add("tendon_spring", "stiffness", m.tendon_stiffness[i]);
  part.Add("tendon_spring", "springlength", m.tendon_lengthspring + 2 * i, 2);
  part.Add("tendon_damping", "damping", m.tendon_damping[i]);
  part.Add("tendon_friction", "frictionloss", m.tendon_frictionloss[i]);
  part.Add("tendon_limit", "limited", m.tendon_limited[i]);
  part.Add("tendon_limit", "range", m.tendon_range + 2 * i, 2);
  for (int k = 0; k < m.tendon_num[i]; ++k) {
    const int wrap = m.tendon_adr[i] + k;
    const int object = m.wrap_objid[wrap];
    const std::string where = fmt::format("point {} of its path", k);
    part.Add("tendon_path", where, m.wrap_type[wrap]);
    switch (m.wrap_type[wrap]) {
      case mjWRAP_JOINT:
        part.names.push_back(NameOf(m, mjOBJ_JOINT, object));
        part.Add("tendon_path", where, m.wrap_prm[wrap]);  // its coefficient
        break;
      case mjWRAP_SITE:
        part.names.push_back(NameOf(m, mjOBJ_SITE, object));
        part.Add("tendon_path", where, m.site_pos + 3 * object, 3);
        break;
      case mjWRAP_SPHERE:
      case mjWRAP_CYLINDER:
        part.names.push_back(NameOf(m, mjOBJ_GEOM, object));
        part.Add("tendon_path", where, m.geom_pos + 3 * object, 3);
        part.Add("tendon_path", where, m.geom_quat + 4 * object, 4);
        part.Add("tendon_path", where, m.geom_size + 3 * object, 3);
        break;
      default:
        part.Add("tendon_path", where, m.wrap_prm[wrap]);  // of a pulley
    }
  }
  return part;
}

void MakeIdleTendon(int i, mjModel* m) {
  m->tendon_stiffness[i] = 0.0;
  m->tendon_damping[i] = 0.0;
  m->tendon_frictionloss[i] = 0.0;
  m->tendon_limited[i] = 0;
}

Part ReadConstraint(const mjModel& m, int i) {
  Part part;
  const int type = m.eq_type[i];
  const mjtObj object = type == mjEQ_JOINT ? mjOBJ_JOINT : type == mjEQ_TENDON ? mjOBJ_TENDON : mjOBJ_BODY;
  for (const int id : {m.eq_obj1id[i], m.eq_obj2id[i]})
    part.names.push_back(id < 0 ? std::string() : NameOf(m, object, id));
  part.Add("equality_constraint", "type", type);
  part.Add("equality_constraint", "active", GetEqualityActive(m)[i]);
  part.Add("equality_constraint", "data", m.eq_data + mjNEQDATA * i, mjNEQDATA);
  return part;
}

/// Sizes of a joint in qpos and qvel.
int CountPositions(int type) { return type == mjJNT_FREE ? 7 : type == mjJNT_BALL ? 4 : 1; }
int CountDofs(int type) { return type == mjJNT_FREE ? 6 : type == mjJNT_BALL ? 3 : 1; }

/// Of a joint of the robot: what a description has no place for.
Part ReadSpring(const mjModel& m, int joint) {
  Part part;
  part.Add("joint_spring", "stiffness", m.jnt_stiffness[joint]);
  mjtNum rest[7] = {};  // of a spring; without one it says nothing
  const int count = CountPositions(m.jnt_type[joint]);
  if (m.jnt_stiffness[joint] != 0.0) mju_copy(rest, m.qpos_spring + m.jnt_qposadr[joint], count);
  part.Add("joint_spring", "springref", rest, count);
  part.Add("joint_stop_margin", "margin", m.jnt_limited[joint] != 0 ? m.jnt_margin[joint] : 0.0);
  return part;
}

void RemoveSpring(int joint, mjModel* m) {
  m->jnt_stiffness[joint] = 0.0;
  m->jnt_margin[joint] = 0.0;
}

/// Of a joint that carries the base, which nothing should hold.
Part ReadBaseJoint(const mjModel& m, int joint) {
  Part part = ReadSpring(m, joint);
  const int dof = m.jnt_dofadr[joint];
  const int count = CountDofs(m.jnt_type[joint]);
  part.Add("joint_damping", "damping", m.dof_damping + dof, count);
  part.Add("joint_armature", "armature", m.dof_armature + dof, count);
  part.Add("joint_dry_friction", "frictionloss", m.dof_frictionloss + dof, count);
  part.Add("joint_limited", "limited", m.jnt_limited[joint]);
  return part;
}

void FreeBaseJoint(int joint, mjModel* m) {
  RemoveSpring(joint, m);
  for (mjtNum* const values : {m->dof_damping, m->dof_armature, m->dof_frictionloss})
    mju_zero(values + m->jnt_dofadr[joint], CountDofs(m->jnt_type[joint]));
  m->jnt_limited[joint] = 0;
}

class ExtrasComparison {
 public:
  ExtrasComparison(const Adapter& a, mjModel* engine_a, const Adapter& b, mjModel* engine_b,
                   ConstantChecks* constants)
      : adapter_a_(a), adapter_b_(b), a_(*engine_a), b_(*engine_b), constants_(*constants) {}

  void Run() {
    CompareJoints();
    CompareByName(mjOBJ_ACTUATOR, "actuator", a_.nu, ReadActuator, MakePlainMotor);
    CompareByName(mjOBJ_TENDON, "tendon", a_.ntendon, ReadTendon, MakeIdleTendon);
    CompareConstraints();
    const int disabled = a_.opt.disableflags & b_.opt.disableflags;
    const int enabled = a_.opt.enableflags & b_.opt.enableflags;
    for (mjModel* const m : {&a_, &b_}) {
      m->opt.disableflags &= ~disabled;
      m->opt.enableflags &= ~enabled;
    }
    Compare("fluid", "density", a_.opt.density, b_.opt.density);
    Compare("fluid", "viscosity", a_.opt.viscosity, b_.opt.viscosity);
    for (mjModel* const m : {&a_, &b_}) m->opt.density = m->opt.viscosity = 0.0;
  }

 private:
  void Compare(const char* check, const std::string& where, double a, double b) {
    if (!AreSame(a, b)) constants_.findings.push_back({check, where, a, b, {}, 0, true});
  }

  void Compare(const std::string& name, const Part& a, const Part& b) {
    const std::string what = name + ", ";
    if (a.names != b.names || a.numbers.size() != b.numbers.size()) {
      const char* const check = a.numbers.front().check;
      Compare(check, what + "acts on other parts", 0.0, 1.0);
      return;
    }
    for (size_t k = 0; k < a.numbers.size(); ++k)
      Compare(a.numbers[k].check, what + a.numbers[k].where, a.numbers[k].value, b.numbers[k].value);
  }

  /// Parts of one kind that both have: compared, then made idle in both.
  template <typename Read, typename MakeIdle>
  void CompareByName(mjtObj type, const std::string& kind, EngineSize count, const Read& read,
                     const MakeIdle& make_idle) {
    for (int i = 0; i < count; ++i) {
      const std::string name = NameOf(a_, type, i);
      const int other = FindByName(type, name);
      if (other < 0) continue;
      Compare(fmt::format("{} {}", kind, name), read(a_, i), read(b_, other));
      make_idle(i, &a_);
      make_idle(other, &b_);
    }
  }

  /// In the second model; those without a name by their number.
  [[nodiscard]] int FindByName(mjtObj type, const std::string& name) const {
    const EngineSize count = type == mjOBJ_ACTUATOR ? b_.nu : type == mjOBJ_TENDON ? b_.ntendon : b_.neq;
    for (int i = 0; i < count; ++i) {
      if (NameOf(b_, type, i) == name) return i;
    }
    return -1;
  }

  void CompareJoints() {
    const auto compare = [&](int a, int b, const auto& read, const auto& make_idle) {
      Compare("joint " + NameOf(b_, mjOBJ_JOINT, b), read(a_, a), read(b_, b));
      make_idle(a, &a_);
      make_idle(b, &b_);
    };
    for (size_t i = 0; i < adapter_a_.joint_ids().size(); ++i) {
      compare(adapter_a_.joint_ids()[i], adapter_b_.joint_ids()[i], ReadSpring, RemoveSpring);
    }
    const std::vector<int>& base_a = adapter_a_.base_joints();
    const std::vector<int>& base_b = adapter_b_.base_joints();
    if (base_a.size() != base_b.size()) return;
    for (size_t i = 0; i < base_a.size(); ++i) compare(base_a[i], base_b[i], ReadBaseJoint, FreeBaseJoint);
  }

  /// All but couplings of joints.
  void CompareConstraints() {
    const auto is_coupling = [](const mjModel& m, int eq) {
      return m.eq_type[eq] == mjEQ_JOINT && FindCouplingConstraint(m, m.eq_obj1id[eq]) == eq;
    };
    for (int i = 0; i < a_.neq; ++i) {
      const std::string name = NameOf(a_, mjOBJ_EQUALITY, i);
      const int other = FindByName(mjOBJ_EQUALITY, name);
      if (other < 0 || is_coupling(a_, i) || is_coupling(b_, other)) continue;
      Compare("constraint " + name, ReadConstraint(a_, i), ReadConstraint(b_, other));
      GetEqualityActive(a_)[i] = 0;
      GetEqualityActive(b_)[other] = 0;
    }
  }

  const Adapter& adapter_a_;
  const Adapter& adapter_b_;
  mjModel& a_;
  mjModel& b_;
  ConstantChecks& constants_;
};

}  // namespace

std::optional<std::string> SetAsideMotors(const std::string& source, mjModel* engine) {
  std::vector<std::string> motors;
  for (int i = 0; i < engine->nu; ++i) {
    if (IsPlainMotor(*engine, i)) continue;
    motors.push_back(NameOf(*engine, mjOBJ_ACTUATOR, i));
    MakePlainMotor(i, engine);
  }
  if (motors.empty()) return std::nullopt;
  return "motors: only " + source +
         " says how they make their forces (servos, muscles, transmissions): " + JoinNames(motors);
}

Extras CompareExtras(const RobotDescription& first, const std::filesystem::path& file, const Adapter& second,
                     mjModel* engine) {
  const MjModelPtr own_engine = LoadMjcf(file);
  const RobotModel own_model(first.spec);
  const Adapter own(own_model, *own_engine, file.string());
  Extras extras;
  ExtrasComparison(own, own_engine.get(), second, engine, &extras.differences).Run();
  extras.of_first = CheckConstants(own);
  CheckDescription(first, own, &extras.of_first);
  return extras;
}

void AddExtras(const Extras& extras, ConstantChecks* constants) {
  std::vector<ConstantFinding> missing;
  for (ConstantFinding finding : extras.of_first.findings) {
    const size_t in_both = std::erase_if(constants->findings, [&](const ConstantFinding& other) {
      return other.check == finding.check && other.where == finding.where &&
             AreSame(other.engine, finding.engine);
    });
    if (in_both > 0) continue;
    std::swap(finding.model, finding.engine);
    missing.push_back(std::move(finding));
  }
  std::erase_if(constants->records, [&](const CheckRecord& record) {
    return record.failed &&
           std::none_of(constants->findings.begin(), constants->findings.end(),
                        [&](const ConstantFinding& finding) { return finding.check == record.name; });
  });
  for (const ConstantFinding& finding : extras.differences.findings) constants->Add(finding);
  for (const ConstantFinding& finding : missing) constants->Add(finding);
}

}  // namespace dexcheck
