#include "harness/diagnosis/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "controller/common/errors.h"
#include "harness/checks/tolerance.h"
#include "harness/diagnosis/body_comparison.h"
#include "harness/diagnosis/body_fit.h"
#include "harness/diagnosis/geometry_walk.h"
#include "harness/diagnosis/repair_check.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;

// Solved numbers that no person would have written have some twelve digits.
constexpr double kSolved = 1e-11;

/// Whether motion shows the constant, so that it need not be read.
bool MovesTheRobot(Kind kind) {
  return kind == Kind::kWheelMass || kind == Kind::kWheelSpinInertia || kind == Kind::kWheelDamping ||
         kind == Kind::kWheelArmature;
}

bool IsOfBothWheels(Kind kind) {
  return MovesTheRobot(kind) || kind == Kind::kWheelRadius || kind == Kind::kWheelDistance;
}

/// "dry friction" of the check "joint_dry_friction": what a finding of something that only the MJCF has is
/// about.
std::string InWords(const std::string& check) {
  for (const char* part : {"joint_", "tendon_"}) {
    if (check.starts_with(part)) return InWords(check.substr(std::string(part).size()));
  }
  std::string words = check;
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

/// Takes from the engine's model what the analytic model cannot have, and says what it was.
std::vector<Repair> Neutralise(const Adapter& adapter, const ConstantChecks& constants, mjModel* engine) {
  std::vector<Repair> causes;
  const auto report = [&](const std::string& note) {
    Repair cause;
    cause.kind = RepairKind::kEngineOnly;
    cause.note = note + " only in the MJCF: the analytic model has none";
    causes.push_back(cause);
  };
  for (const ConstantFinding& finding : constants.findings) {
    if (!finding.engine_only) continue;
    report(fmt::format("{}: {} of {:.9g}", finding.where, InWords(finding.check), finding.engine));
    if (finding.where.starts_with("free joint of "))
      causes.back().note += " (<joint type=\"free\"> takes the defaults of <joint>, <freejoint> does not)";
  }
  if (causes.empty()) return causes;
  std::vector<int> joints = adapter.joint_ids();
  joints.insert(joints.end(), adapter.base_joints().begin(), adapter.base_joints().end());
  for (const EngineWheel& wheel : adapter.wheels()) joints.push_back(wheel.joint);
  for (const int joint : joints) engine->jnt_stiffness[joint] = 0.0;
  for (const int joint : adapter.base_joints()) {
    const int dofs = engine->jnt_type[joint] == mjJNT_FREE ? 6 : 1;
    for (mjtNum* const values : {engine->dof_damping, engine->dof_armature, engine->dof_frictionloss})
      mju_zero(values + engine->jnt_dofadr[joint], dofs);
  }
  for (const EngineWheel& wheel : adapter.wheels()) engine->dof_frictionloss[wheel.dof] = 0.0;
  std::fill_n(engine->tendon_stiffness, engine->ntendon, 0.0);
  std::fill_n(engine->tendon_damping, engine->ntendon, 0.0);
  engine->opt.disableflags = 0;
  engine->opt.density = 0.0;
  engine->opt.viscosity = 0.0;
  return causes;
}

/// Whether a body that can be has become one that no robot can have.
bool MakesImpossible(const RobotSpec& before, const RobotSpec& after) {
  const auto makes = [](const MassProperties& from, const MassProperties& to) {
    return FindPhysicalInconsistency(from).empty() && !FindPhysicalInconsistency(to).empty();
  };
  if (makes(before.base.body, after.base.body)) return true;
  for (size_t i = 0; i < before.joints.size(); ++i) {
    if (makes(before.joints[i].body, after.joints[i].body)) return true;
  }
  return false;
}

/// Takes numbers out of a cause; what remains of it has no equivalents that are known.
void ForgetNumbers(const std::vector<Parameter>& numbers, Repair* cause) {
  for (size_t i = cause->parameters.size(); i-- > 0;) {
    if (std::find(numbers.begin(), numbers.end(), cause->parameters[i]) == numbers.end()) continue;
    cause->parameters.erase(cause->parameters.begin() + static_cast<std::ptrdiff_t>(i));
    cause->values.erase(cause->values.begin() + static_cast<std::ptrdiff_t>(i));
    cause->equivalents.clear();
  }
}

class Diagnostician {
 public:
  Diagnostician(const RobotModel& model, const mjModel& engine, const std::string& source,
                const DiagnosisOptions& options)
      : model_(model), engine_(mj_copyModel(nullptr, &engine)), source_(source), options_(options) {
    result_.repaired = model.spec();
  }

  Diagnosis Run(const std::function<bool(const char*)>& progress) {
    const ConsistencyResult before = Compare(model_);
    result_.agrees = before.Agrees();
    if (result_.agrees) return std::move(result_);
    for (const Repair& cause :
         Neutralise(Adapter(model_, *engine_, source_), before.constants, engine_.get()))
      result_.causes.push_back(cause);
    if (progress("constants")) ReadConstants(before.constants);
    if (progress("geometry")) WalkGeometry();
    if (progress("bodies")) FitBodies();
    progress("verdict");
    WithdrawWhatFails();
    const ConsistencyResult after = Compare(RobotModel(result_.repaired));
    const double solved = std::max(kSolved, options_.tolerance);
    std::copy_if(after.constants.findings.begin(), after.constants.findings.end(),
                 std::back_inserter(result_.remaining_constants), [&](const ConstantFinding& finding) {
                   if (finding.engine_only) return false;  // named already
                   const double size = std::max(std::abs(finding.model), std::abs(finding.engine));
                   return !(std::abs(finding.model - finding.engine) <= solved * size);
                 });
    std::copy_if(after.terms.begin(), after.terms.end(), std::back_inserter(result_.remaining_terms),
                 [&](const CheckRecord& record) { return record.failed && !(record.worst <= solved); });
    Weigh();
    return std::move(result_);
  }

 private:
  [[nodiscard]] ConsistencyResult Compare(const RobotModel& model) const {
    ConsistencyOptions options;
    options.samples = options_.samples;
    options.seed = options_.seed;
    ConsistencyResult result =
        CheckConsistency(Adapter(model, *engine_, source_), options, [](long) { return true; });
    if (options_.tolerance > 0.0) JudgeByTolerance(options_.tolerance, &result);
    return result;
  }

  [[nodiscard]] EngineEvidence Collect(const RobotModel& model) const {
    return {model, *engine_, source_, options_.samples, options_.seed, options_.tolerance};
  }

  /// Takes repairs with values as they will be printed, unless the result cannot be a robot; another repair
  /// may have to come first then. A value that is printed like the file's repairs nothing.
  void Accept(std::vector<Repair> causes) {
    for (size_t before = causes.size() + 1; !causes.empty() && causes.size() < before;) {
      before = causes.size();
      std::erase_if(causes, [&](const Repair& cause) { return TryAccept(cause); });
    }
  }

  bool TryAccept(Repair cause) {
    std::vector<Parameter> changed;
    std::vector<double> values;
    for (size_t i = 0; i < cause.parameters.size(); ++i) {
      const Parameter& parameter = cause.parameters[i];
      const double value = RoundPrinted(parameter, cause.values[i]);
      const RobotSpec& file = model_.spec();
      if (value == ReadBackPrinted(file, parameter, GetValue(result_.repaired, parameter))) continue;
      changed.push_back(parameter);
      values.push_back(value);
    }
    if (changed.empty() && !cause.parameters.empty()) return true;
    cause.parameters = std::move(changed);
    cause.values = std::move(values);
    for (Repair& equal : cause.equivalents) {
      for (size_t i = 0; i < equal.parameters.size(); ++i)
        equal.values[i] = RoundPrinted(equal.parameters[i], equal.values[i]);
    }
    RobotSpec repaired = result_.repaired;
    Apply(cause, &repaired);
    try {
      static_cast<void>(RobotModel(repaired));
    } catch (const InputError&) {
      return false;
    }
    if (MakesImpossible(model_.spec(), repaired)) return false;
    result_.repaired = std::move(repaired);
    // Of a number that is repaired again, the last value holds, in whatever order the repairs are printed.
    for (Repair& earlier : result_.causes) ForgetNumbers(cause.parameters, &earlier);
    std::erase_if(result_.causes, [](const Repair& earlier) {
      return earlier.kind == RepairKind::kParameters && earlier.parameters.empty();
    });
    result_.causes.push_back(std::move(cause));
    return true;
  }

  /// As a person would have written it, unless that is another number; in the precision printed.
  [[nodiscard]] double RoundPrinted(const Parameter& parameter, double value) const {
    const double rounded = RoundSolved(result_.repaired, parameter, value);
    const bool same = rounded == 0.0 || std::abs(rounded - value) <= kSolved * std::abs(value);
    return ReadBackPrinted(model_.spec(), parameter, same ? rounded : value);
  }

  void ReadConstants(const ConstantChecks& constants) {
    struct Reading {
      Parameter parameter;
      double value;
      int count;
      bool agreed;
    };
    std::vector<Reading> readings;
    constexpr double kSame = 1e-12;
    for (const ConstantFinding& finding : constants.findings) {
      const std::optional<Parameter> parameter = FindParameter(result_.repaired, finding);
      if (!parameter || !std::isfinite(finding.engine)) continue;
      if (options_.by_motion && MovesTheRobot(parameter->kind)) continue;
      const auto again = std::find_if(readings.begin(), readings.end(), [&](const Reading& reading) {
        return reading.parameter == *parameter;
      });
      if (again == readings.end()) {
        readings.push_back({*parameter, finding.engine, 1, true});
      } else {
        ++again->count;
        if (std::abs(again->value - finding.engine) > kSame * std::abs(again->value)) again->agreed = false;
      }
    }
    // A vector or a tensor is one cause. When the two wheels disagree, something else is wrong.
    std::vector<Repair> causes;
    for (const Reading& reading : readings) {
      if (!reading.agreed || (IsOfBothWheels(reading.parameter.kind) && reading.count < 2)) continue;
      auto same = std::find_if(causes.begin(), causes.end(), [&](const Repair& cause) {
        return cause.parameters[0].kind == reading.parameter.kind &&
               cause.parameters[0].index == reading.parameter.index;
      });
      if (same == causes.end()) same = causes.insert(causes.end(), Repair{});
      same->parameters.push_back(reading.parameter);
      same->values.push_back(reading.value);
    }
    Accept(std::move(causes));
  }

  void WalkGeometry() {
    const RobotModel model(result_.repaired);
    const EngineEvidence evidence = Collect(model);
    const auto force_error = [&](const RobotSpec& spec) {
      try {
        return evidence.CalcForceResidual(RobotModel(spec)).norm();
      } catch (const InputError&) {
        return std::numeric_limits<double>::infinity();
      }
    };
    GeometryWalk walk(result_.repaired, evidence, !options_.by_motion, force_error);
    for (const Repair& cause : walk.Run()) Accept({cause});
  }

  void FitBodies() {
    const RobotModel model(result_.repaired);
    const EngineEvidence evidence = Collect(model);
    BodyFit fit(result_.repaired, evidence);
    if (options_.by_motion) {
      Accept(fit.Run());
    } else {
      fit.Rank();
      Accept(BodyComparison(result_.repaired, evidence, *engine_).Run());
    }
    result_.ranking = fit.ranking();
  }

  /// Withdraws what does not repair: nothing wrong is printed, however many numbers are wrong at once.
  void WithdrawWhatFails() {
    const RepairCheck check(model_.spec(), *engine_, source_, options_.samples, options_.seed,
                            !options_.by_motion, options_.tolerance);
    check.KeepWhatRepairs(&result_.causes);
    result_.repaired = model_.spec();
    for (const Repair& cause : result_.causes) Apply(cause, &result_.repaired);
  }

  struct Size {
    double all = 0.0;
    double forces = 0.0;
  };

  /// Squared residuals of geometry, bodies, joint constants and forces, each by its own scale.
  [[nodiscard]] Size Measure(const RobotSpec& spec) const {
    const RobotModel model(spec);
    const EngineEvidence evidence = Collect(model);
    const Placement placement(spec, evidence, true);
    Size size;
    size.forces = evidence.CalcForceResidual(model).squaredNorm();
    std::vector<double> rows;
    for (size_t item = 0; item < placement.items().size(); ++item)
      placement.AppendResidual(static_cast<int>(item), &rows);
    for (const double row : rows) size.all += row * row;
    for (const ConstantFinding& finding : CheckConstants(Adapter(model, *engine_, source_)).findings) {
      if (finding.engine_only) continue;
      const double larger = std::max(std::abs(finding.model), std::abs(finding.engine));
      const double apart = (finding.model - finding.engine) / larger;
      if (std::isfinite(apart)) size.all += apart * apart;
    }
    size.all += size.forces;
    return size;
  }

  /// What each cause explains after those before it; the largest first.
  void Weigh() {
    RobotSpec spec = model_.spec();
    const Size before = Measure(spec);
    Size last = before;
    const auto fraction = [](double from, double to, double of) { return of > 0.0 ? (from - to) / of : 0.0; };
    for (Repair& cause : result_.causes) {
      if (cause.kind == RepairKind::kEngineOnly) continue;
      Apply(cause, &spec);
      const Size now = Measure(spec);
      cause.explained = fraction(last.all, now.all, before.all);
      cause.explained_of_forces = fraction(last.forces, now.forces, before.forces);
      last = now;
    }
    result_.explained = before.all > 0.0 ? fraction(before.all, last.all, before.all) : 1.0;
    result_.explained_of_forces =
        before.forces > 0.0 ? fraction(before.forces, last.forces, before.forces) : 1.0;
    // Rows and axes that were exchanged or turned must be repaired in the order found.
    const bool ordered = std::any_of(result_.causes.begin(), result_.causes.end(), [](const Repair& cause) {
      return cause.kind != RepairKind::kParameters && cause.kind != RepairKind::kEngineOnly;
    });
    if (ordered) return;
    std::stable_sort(result_.causes.begin(), result_.causes.end(),
                     [](const Repair& a, const Repair& b) { return a.explained > b.explained; });
  }

  const RobotModel& model_;
  MjModelPtr engine_;
  std::string source_;
  DiagnosisOptions options_;
  Diagnosis result_;
};

}  // namespace

Diagnosis Diagnose(const RobotModel& model, const mjModel& engine, const std::string& engine_source,
                   const DiagnosisOptions& options, const std::function<bool(const char*)>& progress) {
  return Diagnostician(model, engine, engine_source, options).Run(progress);
}

}  // namespace dexcheck
