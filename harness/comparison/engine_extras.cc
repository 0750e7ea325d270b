#include "harness/comparison/engine_extras.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/descriptions/constant_table.h"

namespace dexcheck {
namespace {

bool AreSame(double a, double b) {
  return std::abs(a - b) <= kConstantRounding * Worst(std::abs(a), std::abs(b));
}

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

  template <typename Values>
  void Add(const char* check, const std::string& where, const Values& values) {
    const size_t count = std::size(values);
    for (size_t k = 0; k < count; ++k)
      numbers.push_back({check, count == 1 ? where : where + fmt::format("[{}]", k), values[k]});
  }
  void AddTriple(const char* check, const std::string& where, const mjtNum* values) {
    Add(check, where, std::span(values, 3));
  }
};

/// Reads the constants that the table has for a part; for joints those that belong to the role and stand in
/// no description.
Part ReadPart(const mjModel& m, EnginePart kind, int id, unsigned role) {
  Part part;
  for (const Constant& constant : ListConstants()) {
    if (constant.part == kind && (constant.roles & role) != 0)
      part.Add(constant.check, constant.name, ReadConstant(constant, m, id));
  }
  return part;
}

std::vector<std::string> ListTargets(const mjModel& m, int actuator) {
  const int* const targets = m.actuator_trnid + 2 * actuator;
  switch (m.actuator_trntype[actuator]) {
    case mjTRN_JOINT:
    case mjTRN_JOINTINPARENT:
      return {NameOf(m, mjOBJ_JOINT, targets[0])};
    case mjTRN_TENDON:
      return {NameOf(m, mjOBJ_TENDON, targets[0])};
    case mjTRN_SLIDERCRANK:
      return {NameOf(m, mjOBJ_SITE, targets[0]), NameOf(m, mjOBJ_SITE, targets[1])};
    case mjTRN_SITE:
      return {NameOf(m, mjOBJ_SITE, targets[0])};
    case mjTRN_BODY:
      return {NameOf(m, mjOBJ_BODY, targets[0])};
    default:
      return {};
  }
}

std::vector<std::string> ListTied(const mjModel& m, int constraint) {
  const int type = m.eq_type[constraint];
  const mjtObj object = type == mjEQ_JOINT ? mjOBJ_JOINT : type == mjEQ_TENDON ? mjOBJ_TENDON : mjOBJ_BODY;
  std::vector<std::string> names;
  for (const int id : {m.eq_obj1id[constraint], m.eq_obj2id[constraint]})
    names.push_back(id < 0 ? std::string() : NameOf(m, object, id));
  return names;
}

void AddPath(const mjModel& m, int tendon, Part* part) {
  constexpr const char* kCheck = "tendon_path";
  for (int k = 0; k < m.tendon_num[tendon]; ++k) {
    const int wrap = m.tendon_adr[tendon] + k;
    const int object = m.wrap_objid[wrap];
    const std::string where = fmt::format("point {} of its path", k);
    part->Add(kCheck, where, std::vector<double>{static_cast<double>(m.wrap_type[wrap])});
    switch (m.wrap_type[wrap]) {
      case mjWRAP_SITE:
        part->names.push_back(NameOf(m, mjOBJ_SITE, object));
        part->AddTriple(kCheck, where, m.site_pos + 3 * object);
        break;
      case mjWRAP_SPHERE:
      case mjWRAP_CYLINDER:
        part->names.push_back(NameOf(m, mjOBJ_GEOM, object));
        part->AddTriple(kCheck, where, m.geom_pos + 3 * object);
        part->Add(kCheck, where, std::span<const mjtNum>(m.geom_quat + 4 * object, 4));
        part->AddTriple(kCheck, where, m.geom_size + 3 * object);
        break;
      case mjWRAP_JOINT:
        part->names.push_back(NameOf(m, mjOBJ_JOINT, object));
        [[fallthrough]];
      default:  // a joint's coefficient, or a pulley's divisor
        part->Add(kCheck, where, std::vector<double>{m.wrap_prm[wrap]});
    }
  }
}

/// A part with all that is compared of it.
Part ReadWhole(const mjModel& m, EnginePart kind, int id, unsigned role) {
  Part part = ReadPart(m, kind, id, role);
  if (kind == EnginePart::kActuator) part.names = ListTargets(m, id);
  if (kind == EnginePart::kConstraint) part.names = ListTied(m, id);
  if (kind == EnginePart::kTendon) AddPath(m, id, &part);
  return part;
}

/// An option that acts on no term at a given state.
struct EngineOption {
  const char* name;
  std::vector<double> (*read)(const mjOption& option);
  std::vector<const char*> words = {};  // of the values 0, 1, ...
};

template <auto kMember, int kCount = 1>
std::vector<double> ReadOption(const mjOption& option) {
  if constexpr (kCount == 1) {
    return {static_cast<double>(option.*kMember)};
  } else {
    return {option.*kMember, option.*kMember + kCount};
  }
}

const std::vector<EngineOption> kOptions = {
    {"timestep", ReadOption<&mjOption::timestep>},
    {"integrator", ReadOption<&mjOption::integrator>, {"Euler", "RK4", "implicit", "implicitfast"}},
    {"cone", ReadOption<&mjOption::cone>, {"pyramidal", "elliptic"}},
    {"impratio", ReadOption<&mjOption::impratio>},
    {"solver", ReadOption<&mjOption::solver>, {"PGS", "CG", "Newton"}},
    {"jacobian", ReadOption<&mjOption::jacobian>, {"dense", "sparse", "auto"}},
    {"iterations", ReadOption<&mjOption::iterations>},
    {"tolerance", ReadOption<&mjOption::tolerance>},
    {"noslip_iterations", ReadOption<&mjOption::noslip_iterations>},
    {"noslip_tolerance", ReadOption<&mjOption::noslip_tolerance>},
    {"iterations of the collider",
     [](const mjOption& option) {
       return std::vector<double>{static_cast<double>(GetColliderIterations(option))};
     }},
    {"tolerance of the collider",
     [](const mjOption& option) { return std::vector<double>{GetColliderTolerance(option)}; }},
    {"wind", ReadOption<&mjOption::wind, 3>},
    {"magnetic", ReadOption<&mjOption::magnetic, 3>},
    {"o_margin", ReadOption<&mjOption::o_margin>},
    {"o_solref", ReadOption<&mjOption::o_solref, mjNREF>},
    {"o_solimp", ReadOption<&mjOption::o_solimp, mjNIMP>}};

std::string Show(const EngineOption& option, const std::vector<double>& values) {
  const auto word = static_cast<size_t>(values.front());
  if (values.size() == 1 && word < option.words.size()) return option.words[word];
  return fmt::format("{:g}", fmt::join(values, " "));
}

class ExtrasComparison {
 public:
  ExtrasComparison(const Adapter& a, mjModel* engine_a, const Adapter& b, mjModel* engine_b,
                   ConstantChecks* constants)
      : adapter_a_(a), adapter_b_(b), a_(*engine_a), b_(*engine_b), constants_(*constants) {}

  void Run() {
    CompareJoints();
    CompareByName(EnginePart::kActuator, mjOBJ_ACTUATOR, "actuator");
    CompareByName(EnginePart::kTendon, mjOBJ_TENDON, "tendon");
    CompareByName(EnginePart::kConstraint, mjOBJ_EQUALITY, "constraint");
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

  /// Compares what later releases of the engine add by its element, and takes it out of both.
  /// @return lines on what was taken out.
  std::vector<std::string> LeaveOutNewerForces() {
    std::map<std::string, std::vector<std::string>> names;  // by kind
    for (const NewerForce& force : kNewerForces) {
      const int count = CountElements(b_, force.type);
      if (CountElements(a_, force.type) != count) continue;
      for (int i = 0; i < count * force.columns; ++i) {
        mjtNum& value_a = (a_.*force.values)[i];
        mjtNum& value_b = (b_.*force.values)[i];
        const std::string element = NameOf(b_, force.type, i / force.columns);
        Compare(force.check, element + ": " + force.name, value_a, value_b);
        if (value_a != 0.0 || value_b != 0.0) names[force.check].push_back(element);
        value_a = value_b = 0.0;
      }
    }
    std::vector<std::string> lines;
    lines.reserve(names.size() + 1);
    for (const auto& [check, elements] : names)
      lines.push_back(check + ": left out on both sides, at " + JoinNames(elements));
    LeaveOutFlexes(&a_);
    const int flexes = LeaveOutFlexes(&b_);
    if (flexes > 0) lines.push_back(fmt::format("flex: elastic forces of {} left out on both sides", flexes));
    return lines;
  }

  /// Options that act on steps, contacts and solvers alone.
  [[nodiscard]] std::vector<std::string> CompareOptions(const std::string& file_a,
                                                        const std::string& file_b) const {
    std::vector<std::string> lines;
    for (const EngineOption& option : kOptions) {
      const auto values_a = option.read(a_.opt);
      const auto values_b = option.read(b_.opt);
      if (values_a == values_b) continue;
      lines.push_back(fmt::format("option {}: {} in {}, {} in {}", option.name, Show(option, values_a),
                                  file_a, Show(option, values_b), file_b));
    }
    return lines;
  }

  /// Motors that one has and the other lacks. Those that are no plain torques are in the constant checks.
  [[nodiscard]] std::vector<std::string> ListLoneMotors(const std::string& file_a,
                                                        const std::string& file_b) const {
    std::vector<std::string> lines;
    const auto list = [&](const mjModel& m, const mjModel& other, const std::string& file) {
      std::vector<std::string> names;
      names.reserve(static_cast<size_t>(m.nu));
      for (int i = 0; i < m.nu; ++i) names.push_back(NameOf(m, mjOBJ_ACTUATOR, i));
      for (int i = 0; i < other.nu; ++i) std::erase(names, NameOf(other, mjOBJ_ACTUATOR, i));
      if (!names.empty()) lines.push_back("motors only in " + file + ": " + JoinNames(names));
    };
    list(a_, b_, file_a);
    list(b_, a_, file_b);
    return lines;
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

  /// Compared, then made idle in both.
  void CompareParts(const std::string& name, EnginePart kind, int a, int b, unsigned role) {
    Compare(name, ReadWhole(a_, kind, a, role), ReadWhole(b_, kind, b, role));
    MakeIdle(kind, a, role, &a_);
    MakeIdle(kind, b, role, &b_);
  }

  /// Parts of one kind that both have; those without a name by their number. Not couplings of joints.
  void CompareByName(EnginePart kind, mjtObj type, const std::string& word) {
    const auto is_coupling = [&](const mjModel& m, int id) {
      return kind == EnginePart::kConstraint && m.eq_type[id] == mjEQ_JOINT &&
             FindCouplingConstraint(m, m.eq_obj1id[id]) == id;
    };
    for (int a = 0; a < CountElements(a_, type); ++a) {
      const std::string name = NameOf(a_, type, a);
      for (int b = 0; b < CountElements(b_, type); ++b) {
        if (NameOf(b_, type, b) != name) continue;
        if (!is_coupling(a_, a) && !is_coupling(b_, b))
          CompareParts(fmt::format("{} {}", word, name), kind, a, b, kRobotJoint);
        break;
      }
    }
  }

  void CompareJoints() {
    const auto compare = [&](const std::vector<int>& a, const std::vector<int>& b, JointRole role) {
      for (size_t i = 0; i < a.size(); ++i)
        CompareParts("joint " + NameOf(b_, mjOBJ_JOINT, b[i]), EnginePart::kJoint, a[i], b[i], role);
    };
    compare(adapter_a_.joint_ids(), adapter_b_.joint_ids(), kRobotJoint);
    if (adapter_a_.base_joints().size() == adapter_b_.base_joints().size())
      compare(adapter_a_.base_joints(), adapter_b_.base_joints(), kFreeJoint);
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
    const auto properties = ReadMotor(*engine, i);
    if (std::ranges::all_of(properties,
                            [](const MotorProperty& property) { return property.value == property.plain; }))
      continue;
    const double gear = engine->actuator_gear[6 * i];
    motors.push_back(NameOf(*engine, mjOBJ_ACTUATOR, i) +
                     (gear == 1.0 ? "" : fmt::format(" (gear {:g})", gear)));
    MakeIdle(EnginePart::kActuator, i, kRobotJoint, engine);
  }
  if (motors.empty()) return std::nullopt;
  return "motors: only " + source +
         " says how they make their forces (servos, muscles, transmissions, gears): " + JoinNames(motors);
}

Extras CompareExtras(const RobotDescription& first, MjModelPtr first_engine, const std::string& file,
                     const Adapter& second, mjModel* engine, const std::string& other) {
  const RobotModel own_model(first.spec);
  const Adapter own(own_model, *first_engine, file);
  Extras extras;
  ExtrasComparison comparison(own, first_engine.get(), second, engine, &extras.differences);
  const std::string names[] = {std::filesystem::path(file).filename(),
                               std::filesystem::path(other).filename()};
  extras.without_effect = comparison.CompareOptions(names[0], names[1]);
  extras.not_compared = comparison.ListLoneMotors(names[0], names[1]);
  for (std::string& line : comparison.LeaveOutNewerForces()) extras.not_compared.push_back(std::move(line));
  comparison.Run();
  extras.of_first = CheckConstants(own);
  CheckCouplings(own, /*ignores=*/false, &extras.of_first);
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
    return record.failed && std::ranges::none_of(constants->findings, [&](const ConstantFinding& finding) {
             return finding.check == record.name;
           });
  });
  for (const ConstantFinding& finding : extras.differences.findings) constants->Add(finding);
  for (const ConstantFinding& finding : missing) constants->Add(finding);
}

std::vector<std::string> CompareContacts(const ConstantChecks& first, const ConstantChecks& second) {
  std::vector<std::string> lines;
  for (const auto& [kind, word] : {std::pair("contacts_by_type", "contacts by contype and conaffinity"),
                                   {"contact_pair", "contact pairs"},
                                   {"mesh_contacts", "meshes that touch"}}) {
    std::map<std::string, std::string> texts[2];
    for (const size_t side : {0U, 1U}) {
      for (const ConstantNote& note : (side == 0 ? first : second).notes) {
        const size_t end = std::min(note.text.find(" ("), note.text.find(": "));
        if (note.kind == kind) texts[side][note.text.substr(0, end)] += note.text;
      }
    }
    std::vector<std::string> differing;
    for (const size_t side : {0U, 1U}) {
      for (const auto& [name, text] : texts[side]) {
        const auto other = texts[1 - side].find(name);
        const bool is_missing = other == texts[1 - side].end();
        if (is_missing || (side == 0 && other->second != text)) differing.push_back(name);
      }
    }
    if (!differing.empty())
      lines.push_back(std::string(word) + ": shapes, places, friction or parameters differ at " +
                      Abbreviate(JoinNames(differing)));
  }
  return lines;
}

}  // namespace dexcheck
