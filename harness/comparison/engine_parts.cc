#include "harness/comparison/engine_parts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/comparison/engine_contacts.h"
#include "harness/engine/engine.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

/// Adds numbers of an array, "gear[0]" to "gear[5]". @param neutral of the first of them.
template <typename Values>
void AddNumbers(const char* check, const std::string& name, const Values& values,
                std::optional<double> neutral, EnginePart* part) {
  const size_t count = std::size(values);
  for (size_t k = 0; k < count; ++k)
    part->numbers.push_back({check, count == 1 ? name : fmt::format("{}[{}]", name, k),
                             static_cast<double>(values[k]), k == 0 ? neutral : std::nullopt});
}

/// Properties of an actuator that a plain torque on its joint, which equals the control, has not.
std::array<PartNumber, 5> ReadMotor(const mjModel& m, int i) {
  const int transmission = m.actuator_trntype[i];
  const bool has_gain = m.actuator_gaintype[i] == mjGAIN_FIXED && m.actuator_gear[6 * i] != 0.0;
  // No other gain is comparable.
  const double gain = has_gain ? m.actuator_gainprm[mjNGAIN * i] : std::numeric_limits<double>::quiet_NaN();
  const auto property = [](const char* check, double plain, double value) {
    return PartNumber{check, "", value, plain, 0.0, true};
  };
  return {property("motor_transmission", mjTRN_JOINT,
                   transmission == mjTRN_JOINTINPARENT ? mjTRN_JOINT : transmission),
          property("motor_transmission", 1.0, m.actuator_gear[6 * i]),
          property("motor_dynamics", mjDYN_NONE, m.actuator_dyntype[i]), property("motor_gain", 1.0, gain),
          property("motor_bias", mjBIAS_NONE, m.actuator_biastype[i])};
}

std::vector<std::string> ListTargets(const mjModel& m, int actuator) {
  static const std::map<int, mjtObj> kTypes = {
      {mjTRN_JOINT, mjOBJ_JOINT},   {mjTRN_JOINTINPARENT, mjOBJ_JOINT}, {mjTRN_SLIDERCRANK, mjOBJ_SITE},
      {mjTRN_TENDON, mjOBJ_TENDON}, {mjTRN_SITE, mjOBJ_SITE},           {mjTRN_BODY, mjOBJ_BODY}};
  const int transmission = m.actuator_trntype[actuator];
  const auto type = kTypes.find(transmission);
  std::vector<std::string> names;
  for (int k = 0; type != kTypes.end() && k < (transmission == mjTRN_SLIDERCRANK ? 2 : 1); ++k)
    names.push_back(NameOf(m, type->second, m.actuator_trnid[2 * actuator + k]));
  return names;
}

std::vector<std::string> ListTied(const mjModel& m, int constraint) {
  const int type = m.eq_type[constraint];
  const mjtObj object = type == mjEQ_JOINT ? mjOBJ_JOINT : type == mjEQ_TENDON ? mjOBJ_TENDON : mjOBJ_BODY;
  std::vector<std::string> names;
  for (const int id : {m.eq_obj1id[constraint], m.eq_obj2id[constraint]})
    names.push_back(id < 0 ? std::string() : NameOf(m, object, id));
  return names;
}

void AddPath(const mjModel& m, int tendon, EnginePart* part) {
  for (int k = 0; k < m.tendon_num[tendon]; ++k) {
    const int wrap = m.tendon_adr[tendon] + k;
    const int object = m.wrap_objid[wrap];
    const auto add = [&](const auto* values, size_t count) {
      AddNumbers("tendon_path", fmt::format("point {} of its path", k), std::span(values, count), {}, part);
    };
    add(m.wrap_type + wrap, 1);
    switch (m.wrap_type[wrap]) {
      case mjWRAP_SITE:
        part->acts_on.push_back(NameOf(m, mjOBJ_SITE, object));
        add(m.site_pos + 3 * object, 3);
        break;
      case mjWRAP_SPHERE:
      case mjWRAP_CYLINDER:
        part->acts_on.push_back(NameOf(m, mjOBJ_GEOM, object));
        add(m.geom_pos + 3 * object, 3);
        add(m.geom_quat + 4 * object, 4);
        add(m.geom_size + 3 * object, 3);
        break;
      case mjWRAP_JOINT:
        part->acts_on.push_back(NameOf(m, mjOBJ_JOINT, object));
        [[fallthrough]];
      default:  // a joint's coefficient, or a pulley's divisor
        add(m.wrap_prm + wrap, 1);
    }
  }
}

class PartReader {
 public:
  PartReader(const Adapter& adapter, const PartOptions& options)
      : adapter_(adapter), engine_(adapter.engine()), options_(options) {}

  EngineParts Read() {
    AddJoints();
    EnginePart& fluid = list_.parts.emplace_back(EnginePart{"fluid", "", ""});
    fluid.numbers = {{"fluid", "density", engine_.opt.density, 0.0},
                     {"fluid", "viscosity", engine_.opt.viscosity, 0.0}};
    for (int i = 0; i < engine_.ntendon; ++i)
      AddPath(engine_, i, &Add(PartKind::kTendon, mjOBJ_TENDON, "tendon", i));
    AddConstraints();
    for (int i = 0; i < engine_.nu; ++i) AddMotor(i);
    AddNewerForces();
    AddFlags();
    AddContacts(adapter_, &list_);
    return std::move(list_);
  }

 private:
  /// Adds the constants that the table has for a part.
  void AddConstants(EnginePart* part) const {
    for (const Constant& constant : ListConstants()) {
      if (constant.part != *part->kind || (constant.roles & part->role) == 0) continue;
      const bool applies = constant.applies == nullptr || constant.applies(engine_, part->id);
      // A motor that one model has alone is judged as a whole.
      const bool is_neutral = applies && *part->kind != PartKind::kActuator;
      const size_t first = part->numbers.size();
      AddNumbers(constant.check, constant.name, ReadConstant(constant, engine_, part->id),
                 is_neutral ? constant.neutral : std::nullopt, part);
      if (constant.index == Constant::Index::kPart) continue;
      for (size_t k = first; k < part->numbers.size(); ++k)
        part->numbers[k].neutral = part->numbers[first].neutral;
    }
  }

  EnginePart& Add(PartKind kind, mjtObj type, const char* word, int id) {
    const std::string name = std::string(word) + " " + NameOf(engine_, type, id);
    EnginePart& part = list_.parts.emplace_back(EnginePart{name, name, name});
    part.kind = kind;
    part.id = id;
    AddConstants(&part);
    return part;
  }

  /// Joints that carry the base or the object: nothing holds or drives them. And springs, dry friction and
  /// limits where the analytic model has none.
  void AddJoints() {
    const std::vector<int>& base = adapter_.base_joints();
    for (size_t i = 0; i < base.size(); ++i)
      AddJoint(base[i], kFreeJoint, {Location::Kind::kLink, -1, -1},
               fmt::format("joint {} of {} of the base", i, base.size()));
    for (int k = 0; k < static_cast<int>(adapter_.wheels().size()); ++k)
      AddJoint(adapter_.wheels()[static_cast<size_t>(k)].joint, kWheelJoint, {Location::Kind::kWheel, k, -1},
               fmt::format("wheel {}", k));
    for (int i = 0; i < adapter_.model().num_joints(); ++i)
      AddJoint(adapter_.joint_ids()[static_cast<size_t>(i)], kRobotJoint, {Location::Kind::kJoint, i, -1},
               fmt::format("joint {}", i));
    const int object = adapter_.object_body();
    for (int k = 0; object >= 0 && k < engine_.body_jntnum[object]; ++k)
      AddJoint(engine_.body_jntadr[object] + k, kFreeJoint, {Location::Kind::kObject, -1, -1},
               fmt::format("joint {} of the object", k));
  }

  void AddJoint(int id, JointRole role, const Location& at, const std::string& key) {
    std::string place = Describe(at, adapter_.model(), adapter_.model().num_base_velocities());
    if (at.kind == Location::Kind::kLink)
      place = (engine_.jnt_type[id] == mjJNT_FREE ? "free joint of " : "joints of ") + place;
    EnginePart& part = list_.parts.emplace_back(
        EnginePart{key, "joint " + NameOf(engine_, mjOBJ_JOINT, id), std::move(place), at});
    part.kind = PartKind::kJoint;
    part.id = id;
    part.role = role;
    AddConstants(&part);
  }

  void AddConstraints() {
    std::set<int> couplings;
    for (int i = 0; options_.leaves_out_couplings && i < adapter_.model().num_joints(); ++i) {
      const int id = adapter_.joint_ids()[static_cast<size_t>(i)];
      const std::optional<JointCoupling> coupling = FindEngineCoupling(engine_, id);
      if (!coupling) continue;
      const int leader = IndexOf(adapter_.joint_ids(), coupling->leader);
      const bool leads = leader >= 0 && adapter_.model().joint(leader).coupling &&
                         adapter_.model().joint(leader).coupling->leader == i;
      if (options_.leaves_out_all_couplings || adapter_.model().joint(i).coupling || leads)
        couplings.insert(FindCouplingConstraint(engine_, id));
    }
    for (int i = 0; i < engine_.neq; ++i) {
      if (couplings.contains(i)) continue;
      EnginePart& part = Add(PartKind::kConstraint, mjOBJ_EQUALITY, "constraint", i);
      part.acts_on = ListTied(engine_, i);
    }
  }

  /// A motor is a torque on its joint, and its control is that torque: its gear is 1.
  void AddMotor(int i) {
    EnginePart& part = Add(PartKind::kActuator, mjOBJ_ACTUATOR, "actuator", i);
    part.acts_on = ListTargets(engine_, i);
    bool is_plain = true;
    for (PartNumber& property : ReadMotor(engine_, i)) {
      is_plain = is_plain && property.value == *property.neutral;
      if (options_.leaves_out_motors) property.value = *property.neutral;
      part.numbers.push_back(std::move(property));
    }
    const double gear = engine_.actuator_gear[6 * i];
    if (options_.leaves_out_motors && !is_plain)
      list_.motors.push_back(NameOf(engine_, mjOBJ_ACTUATOR, i) +
                             (gear == 1.0 ? "" : fmt::format(" (gear {:g})", gear)));
    const auto note = [&](const char* what, const mjtNum* range) {
      list_.notes.push_back(
          {"motor_limit", fmt::format("{}: {} from {:.17g} {:.17g}", part.name, what, range[0], range[1])});
    };
    if (engine_.actuator_ctrllimited[i] != 0) note("control", engine_.actuator_ctrlrange + 2 * i);
    if (engine_.actuator_forcelimited[i] != 0) note("force", engine_.actuator_forcerange + 2 * i);
  }

  /// Adds forces and inertias that later releases of the engine add to the mechanism.
  void AddNewerForces() {
    for (const NewerForce& force : kNewerForces) {
      const mjtNum* const values = engine_.*force.values;
      for (int i = 0; i < CountElements(engine_, force.type) * force.columns; ++i) {
        const std::string name = NameOf(engine_, force.type, i / force.columns) + ": " + force.name;
        list_.parts.push_back({fmt::format("{} {} {}", force.check, i % force.columns, name), "", name});
        list_.parts.back().numbers = {{force.check, name, values[i], 0.0}};
      }
    }
    for (const NewerPart& newer : kNewerParts) {
      list_.parts.push_back({newer.name, "", newer.name});
      list_.parts.back().numbers = {
          {"newer_part", newer.name, static_cast<double>(engine_.*newer.count), 0.0}};
    }
  }

  void AddFlags() {
    // Sensors measure only; so do the energy, the comparison with the inverse dynamics and sensors' noise.
    constexpr int kHarmlessToDisable = mjDSBL_SENSOR;
    constexpr int kHarmlessToEnable = mjENBL_ENERGY | mjENBL_FWDINV | kSensorNoiseFlag;
    const auto add = [&](const char* check, std::span<const char* const> names, int flags, int harmless) {
      EnginePart& part = list_.parts.emplace_back(EnginePart{check, "", ""});
      for (size_t i = 0; i < names.size(); ++i) {
        const int flag = 1 << i;
        if ((flag & harmless) == 0)
          part.numbers.push_back({check, names[i], (flags & flag) != 0 ? 1.0 : 0.0, 0.0});
      }
      const int unknown = flags & ~((1 << names.size()) - 1);
      part.numbers.push_back({check, "unknown flag", static_cast<double>(unknown), 0.0});
    };
    add("disable_flag", {mjDISABLESTRING, mjNDISABLE}, engine_.opt.disableflags, kHarmlessToDisable);
    add("enable_flag", {mjENABLESTRING, mjNENABLE}, engine_.opt.enableflags, kHarmlessToEnable);
  }

  const Adapter& adapter_;
  const mjModel& engine_;
  const PartOptions& options_;
  EngineParts list_;
};

}  // namespace

EngineParts ListEngineParts(const Adapter& adapter, const PartOptions& options) {
  return PartReader(adapter, options).Read();
}

void CompareParts(const std::vector<EnginePart>& first, const std::vector<EnginePart>& second,
                  ConstantChecks* result) {
  const auto compare = [&](const PartNumber& number, const EnginePart& part, const std::string& where,
                           double a, double b) {
    if (a == b && !number.neutral) return;  // no check is defined by what only differs beside another model
    double error = std::abs(a - b) <= number.tolerance ? 0.0 : std::abs(a - b);
    // How large a force may be that should not be there is nothing that a relative tolerance says.
    if (number.tolerance == 0.0 && error > 0.0) error /= Worst(std::abs(a), std::abs(b));
    CheckRecord* const record = result->Define(number.check);
    const bool is_same = record->CompareError(error, a, b, part.at, -1) <= kConstantRounding;
    const ConstantFinding finding{number.check, where, a, b, part.at};
    const auto is_known = [&](const ConstantFinding& other) {
      return other.check == finding.check && other.where == where && other.model == a && other.engine == b;
    };
    // A constant that all six coordinates of a free joint share is said once.
    if (!is_same && std::ranges::none_of(result->findings, is_known)) result->findings.push_back(finding);
  };
  const auto compare_alone = [&](const EnginePart& part, bool is_first) {
    for (const PartNumber& number : part.numbers) {
      // A part of the first file that does nothing is no difference, and no check of the second.
      if (number.neutral && !(is_first && number.value == *number.neutral))
        compare(number, part, part.place.empty() ? number.name : part.place,
                is_first ? number.value : *number.neutral, is_first ? *number.neutral : number.value);
    }
  };
  for (const EnginePart& part : second) {
    const EnginePart* const own = FindIn(first, part.key, &EnginePart::key);
    if (own == nullptr) {
      compare_alone(part, false);
      continue;
    }
    const std::string prefix = part.name.empty() ? "" : part.name + ", ";
    const bool is_other = own->acts_on != part.acts_on || own->numbers.size() != part.numbers.size();
    if (is_other) compare(part.numbers.front(), part, prefix + "acts on other parts", 0.0, 1.0);
    for (size_t k = 0; k < part.numbers.size(); ++k) {
      const PartNumber& number = part.numbers[k];
      const bool is_left_out = is_other || number.is_summary;
      if (!is_left_out) {
        compare(number, part, prefix + number.name, own->numbers[k].value, number.value);
      } else if (number.neutral) {
        compare(number, part, "", *number.neutral, *number.neutral);
      }
    }
  }
  for (const EnginePart& part : first) {
    if (FindIn(second, part.key, &EnginePart::key) == nullptr) compare_alone(part, true);
  }
}

std::vector<std::string> LeaveOutShared(const std::vector<EnginePart>& first,
                                        const std::vector<EnginePart>& second, const mjModel& first_engine,
                                        mjModel* engine) {
  for (const EnginePart& part : second) {
    // Motors and constraints act on no term.
    const bool acts = part.kind == PartKind::kJoint || part.kind == PartKind::kTendon;
    if (acts && FindIn(first, part.key, &EnginePart::key) != nullptr)
      MakeIdle(*part.kind, part.id, part.role, engine);
  }
  engine->opt.disableflags &= ~first_engine.opt.disableflags;
  engine->opt.enableflags &= ~first_engine.opt.enableflags;
  engine->opt.density = engine->opt.viscosity = 0.0;
  std::map<std::string, std::vector<std::string>> names;  // by kind
  for (const NewerForce& force : kNewerForces) {
    const int count = CountElements(*engine, force.type);
    if (CountElements(first_engine, force.type) != count) continue;
    for (int i = 0; i < count * force.columns; ++i) {
      mjtNum& value = (engine->*force.values)[i];
      if (value != 0.0 || (first_engine.*force.values)[i] != 0.0)
        names[force.check].push_back(NameOf(*engine, force.type, i / force.columns));
      value = 0.0;
    }
  }
  std::vector<std::string> lines;
  lines.reserve(names.size() + 1);
  for (const auto& [check, elements] : names)
    lines.push_back(check + ": left out on both sides, at " + JoinNames(elements));
  const int flexes = LeaveOutFlexes(engine);
  if (flexes > 0) lines.push_back(fmt::format("flex: elastic forces of {} left out on both sides", flexes));
  return lines;
}

void MatchMotors(const std::vector<EnginePart>& first, std::vector<EnginePart>* second) {
  const auto list_lone = [](const auto& own, const auto& other) {
    std::multimap<std::vector<std::string>, size_t> lone;  // by what they act on
    for (size_t i = 0; i < own.size(); ++i) {
      if (own[i].kind == PartKind::kActuator && FindIn(other, own[i].key, &EnginePart::key) == nullptr)
        lone.emplace(own[i].acts_on, i);
    }
    return lone;
  };
  const auto ours = list_lone(first, *second), theirs = list_lone(*second, first);
  for (const auto& [acts_on, i] : theirs) {
    if (ours.count(acts_on) == 1 && theirs.count(acts_on) == 1)
      (*second)[i].key = first[ours.find(acts_on)->second].key;
  }
}

namespace {

/// Keys or names of motors of one file that the other one has, too, or has not.
std::vector<std::string> ListMotors(const std::vector<EnginePart>& own, const std::vector<EnginePart>& other,
                                    bool is_shared, std::string EnginePart::*word = &EnginePart::name) {
  std::vector<std::string> words;
  for (const EnginePart& part : own) {
    const bool is_in_other = FindIn(other, part.key, &EnginePart::key) != nullptr;
    if (part.kind == PartKind::kActuator && is_in_other == is_shared)
      words.push_back((part.*word).substr((part.*word).find(' ') + 1));
  }
  return words;
}

}  // namespace

std::vector<std::string> ListLoneMotors(const std::vector<EnginePart>& first,
                                        const std::vector<EnginePart>& second, const std::string& first_file,
                                        const std::string& second_file) {
  std::vector<std::string> lines;
  const auto list = [&](const auto& own, const auto& other, const std::string& file) {
    const std::vector<std::string> names = ListMotors(own, other, false);
    if (!names.empty()) lines.push_back("motors only in " + file + ": " + JoinNames(names));
  };
  list(first, second, first_file);
  list(second, first, second_file);
  return lines;
}

std::vector<std::string> CompareMotorOrder(const std::vector<EnginePart>& first,
                                           const std::vector<EnginePart>& second,
                                           const std::string& first_file, const std::string& second_file) {
  if (ListMotors(first, second, true, &EnginePart::key) == ListMotors(second, first, true, &EnginePart::key))
    return {};
  return {fmt::format("order of motors, and of their controls: {} in {}; {} in {}",
                      JoinNames(ListMotors(first, second, true)), first_file,
                      JoinNames(ListMotors(second, first, true)), second_file)};
}

}  // namespace dexcheck
