#include "harness/diagnosis/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "controller/common/errors.h"
#include "harness/diagnosis/body_fit.h"
#include "harness/diagnosis/geometry_walk.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;

/// The number of the parameter file that a constant of the static gate is, when it can be read there at once.
std::optional<Parameter> FindParameter(const GateFinding& finding) {
  const std::string& check = finding.check;
  const int part = finding.location.first;
  if (check == "joint_range")
    return Parameter{finding.entry == 0 ? Kind::kLowerLimit : Kind::kUpperLimit, part, 0};
  if (check == "fingertip_radius") return Parameter{Kind::kSphereRadius, part, 0};
  if (check == "object_mass") return Parameter{Kind::kObjectMass, -1, 0};
  if (check == "object_shape")
    return Parameter{finding.entry == 0 ? Kind::kObjectRingRadius : Kind::kObjectTubeRadius, -1, 0};
  if (check == "contact_friction") return Parameter{Kind::kObjectFriction, -1, 0};
  if (check == "object_inertia") {
    static constexpr int kEntries[9] = {0, 3, 4, 3, 1, 5, 4, 5, 2};
    return Parameter{Kind::kObjectInertia, -1, kEntries[finding.entry]};
  }
  if (check == "wheel_radius") return Parameter{Kind::kWheelRadius, -1, 0};
  if (check == "wheel_distance") return Parameter{Kind::kWheelDistance, -1, 0};
  if (check == "wheel_mass") return Parameter{Kind::kWheelMass, -1, 0};
  if (check == "wheel_spin_inertia") return Parameter{Kind::kWheelSpinInertia, -1, 0};
  if (check == "wheel_damping") return Parameter{Kind::kWheelDamping, -1, 0};
  if (check == "wheel_armature") return Parameter{Kind::kWheelArmature, -1, 0};
  return std::nullopt;
}

/// Whether motion shows the constant, so that it need not be read.
bool MovesTheRobot(Kind kind) {
  return kind == Kind::kWheelMass || kind == Kind::kWheelSpinInertia || kind == Kind::kWheelDamping ||
         kind == Kind::kWheelArmature;
}

bool IsOfBothWheels(Kind kind) {
  return MovesTheRobot(kind) || kind == Kind::kWheelRadius || kind == Kind::kWheelDistance;
}

/// Takes from the engine's model what the analytic model cannot have, and says what it was.
std::vector<Cause> Neutralise(const Adapter& adapter, const GateResult& gate, mjModel* engine) {
  std::vector<Cause> causes;
  const auto report = [&](const std::string& note) {
    Cause cause;
    cause.kind = CauseKind::kEngineOnly;
    cause.note = note + " only in the MJCF: the analytic model has none";
    causes.push_back(cause);
  };
  for (const GateFinding& finding : gate.findings) {
    if (finding.check == "joint_spring")
      report(fmt::format("{}: spring of {:.9g}", finding.where, finding.engine));
    if (finding.check == "joint_dry_friction" && finding.model == 0.0)
      report(fmt::format("{}: dry friction of {:.9g}", finding.where, finding.engine));
    if (finding.check == "fluid")
      report(fmt::format("a fluid (density or viscosity {:.9g})", finding.engine));
  }
  if (causes.empty()) return causes;
  std::vector<int> joints = adapter.joint_ids();
  joints.insert(joints.end(), adapter.base_joints().begin(), adapter.base_joints().end());
  for (const EngineWheel& wheel : adapter.wheels()) joints.push_back(wheel.joint);
  for (const int joint : joints) {
    engine->jnt_stiffness[joint] = 0.0;
    engine->dof_frictionloss[engine->jnt_dofadr[joint]] = 0.0;
  }
  engine->opt.density = 0.0;
  engine->opt.viscosity = 0.0;
  return causes;
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
    for (const Cause& cause : Neutralise(Adapter(model_, *engine_, source_), before.gate, engine_.get()))
      result_.causes.push_back(cause);
    if (progress("constants")) ReadConstants(before.gate);
    if (progress("geometry")) WalkGeometry();
    if (progress("bodies")) FitBodies();
    progress("verdict");
    const ConsistencyResult after = Compare(RobotModel(result_.repaired));
    // Solved numbers that no person would have written have some twelve digits.
    constexpr double kSolved = 1e-11;
    std::copy_if(after.gate.findings.begin(), after.gate.findings.end(),
                 std::back_inserter(result_.remaining_constants), [](const GateFinding& finding) {
                   const double size = std::max(std::abs(finding.model), std::abs(finding.engine));
                   return !(std::abs(finding.model - finding.engine) <= kSolved * size);
                 });
    std::copy_if(after.terms.begin(), after.terms.end(), std::back_inserter(result_.remaining_terms),
                 [](const CheckRecord& record) { return record.failed && !(record.worst <= kSolved); });
    Weigh();
    return std::move(result_);
  }

 private:
  [[nodiscard]] ConsistencyResult Compare(const RobotModel& model) const {
    ConsistencyOptions options;
    options.samples = options_.samples;
    options.seed = options_.seed;
    return CheckConsistency(Adapter(model, *engine_, source_), options, [](long) { return true; });
  }

  [[nodiscard]] EngineEvidence Collect(const RobotModel& model) const {
    return {model, *engine_, source_, options_.samples, options_.seed};
  }

  /// Takes a repair unless the result cannot be a robot.
  void Accept(Cause cause) {
    for (size_t i = 0; i < cause.parameters.size(); ++i)
      cause.values[i] = RoundSolved(result_.repaired, cause.parameters[i], cause.values[i]);
    RobotSpec repaired = result_.repaired;
    Apply(cause, &repaired);
    try {
      static_cast<void>(RobotModel(repaired));
    } catch (const InputError&) {
      return;
    }
    result_.repaired = std::move(repaired);
    result_.causes.push_back(std::move(cause));
  }

  void ReadConstants(const GateResult& gate) {
    struct Reading {
      Parameter parameter;
      double value;
      int count;
      bool agreed;
    };
    std::vector<Reading> readings;
    constexpr double kSame = 1e-12;
    for (const GateFinding& finding : gate.findings) {
      const std::optional<Parameter> parameter = FindParameter(finding);
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
    std::vector<Cause> causes;
    for (const Reading& reading : readings) {
      if (!reading.agreed || (IsOfBothWheels(reading.parameter.kind) && reading.count < 2)) continue;
      auto same = std::find_if(causes.begin(), causes.end(), [&](const Cause& cause) {
        return cause.parameters[0].kind == reading.parameter.kind &&
               cause.parameters[0].index == reading.parameter.index;
      });
      if (same == causes.end()) same = causes.insert(causes.end(), Cause{});
      same->parameters.push_back(reading.parameter);
      same->values.push_back(reading.value);
    }
    for (const Cause& cause : causes) Accept(cause);
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
    for (const Cause& cause : walk.Run()) Accept(cause);
  }

  void FitBodies() {
    const RobotModel model(result_.repaired);
    const EngineEvidence evidence = Collect(model);
    BodyFit fit(result_.repaired, evidence, *engine_, !options_.by_motion);
    for (const Cause& cause : fit.Run()) Accept(cause);
    result_.ranking = fit.ranking();
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
    for (const GateFinding& finding : RunStaticGate(Adapter(model, *engine_, source_)).findings) {
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
    const auto share = [](double from, double to, double of) { return of > 0.0 ? (from - to) / of : 0.0; };
    for (Cause& cause : result_.causes) {
      if (cause.kind == CauseKind::kEngineOnly) continue;
      Apply(cause, &spec);
      const Size now = Measure(spec);
      cause.explained = share(last.all, now.all, before.all);
      cause.explained_of_forces = share(last.forces, now.forces, before.forces);
      last = now;
    }
    result_.explained = before.all > 0.0 ? share(before.all, last.all, before.all) : 1.0;
    result_.explained_of_forces =
        before.forces > 0.0 ? share(before.forces, last.forces, before.forces) : 1.0;
    std::stable_sort(result_.causes.begin(), result_.causes.end(),
                     [](const Cause& a, const Cause& b) { return a.explained > b.explained; });
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
