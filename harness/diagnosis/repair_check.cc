#include "harness/diagnosis/repair_check.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "controller/common/errors.h"
#include "harness/diagnosis/body_comparison.h"

namespace dexcheck {
namespace {

using Kind = ParameterKind;

// Relative; thirteen digits are printed, and a chain of some dozen rotations keeps as many.
constexpr double kSame = 1e-11;

// Of forces that follow from fitted numbers, relative to their size.
constexpr double kSameForces = 1e-8;

/// Whether Sigma_0 stands where the engine's wheels have the middle of their axle; without wheels it stands
/// where it is said to.
bool IsAxleRight(const Adapter& adapter, double rounding) {
  Vector3d sum = Vector3d::Zero();
  for (const EngineWheel& wheel : adapter.wheels()) {
    sum += wheel.center;
    if (!(std::hypot(wheel.center.x(), wheel.center.z()) <= rounding)) return false;
  }
  return std::abs(sum.y()) <= rounding;
}

}  // namespace

std::optional<Parameter> FindParameter(const RobotSpec& spec, const ConstantFinding& finding) {
  if (finding.engine_only) return std::nullopt;
  return FindParameter(spec, finding.check, finding.location.first, finding.entry);
}

/// A repaired model and what is still wrong with it.
struct RepairCheck::Trial {
  Trial(RobotSpec repaired, const mjModel& engine, const std::string& source, int samples, std::uint64_t seed,
        bool bodies, double tolerance)
      : spec(std::move(repaired)),
        model(spec),
        evidence(model, engine, source, samples, seed, tolerance),
        placement(spec, evidence, bodies) {
    for (const ConstantFinding& finding : CheckConstants(Adapter(model, engine, source)).findings) {
      const std::optional<Parameter> parameter = FindParameter(spec, finding);
      const double size = std::max(std::abs(finding.model), std::abs(finding.engine));
      const bool same = std::abs(finding.model - finding.engine) <= evidence.Widen(kSame) * size;
      if (parameter && !same) wrong.push_back(*parameter);
    }
    axle_right = IsAxleRight(Adapter(model, engine, source), evidence.Widen(kSame) * evidence.length());
    if (bodies) {
      for (const Repair& cause : BodyComparison(spec, evidence, engine).Run())
        wrong.insert(wrong.end(), cause.parameters.begin(), cause.parameters.end());
    } else {
      forces_agree = evidence.CalcForceResidual(model).cwiseAbs().maxCoeff() <= evidence.Widen(kSameForces);
    }
  }

  /// Whether a link stands where the engine has it, with its body.
  [[nodiscard]] bool IsLinkRight(int link) const {
    if (!IsPlaced(placement, link)) return false;
    for (size_t i = 0; i < placement.items().size(); ++i) {
      const PlacedItem& item = placement.items()[i];
      if (item.link == link && placement.Fails(static_cast<int>(i))) return false;
    }
    return true;
  }

  RobotSpec spec;
  RobotModel model;
  EngineEvidence evidence;
  Placement placement;
  std::vector<Parameter> wrong;  // numbers that differ from what is read from the engine
  bool forces_agree = true;
  bool axle_right = true;  // what the base's numbers are relative to
};

RepairCheck::RepairCheck(RobotSpec original, const mjModel& engine, std::string engine_source, int samples,
                         std::uint64_t seed, bool bodies, double tolerance)
    : original_(std::move(original)),
      engine_(engine),
      source_(std::move(engine_source)),
      samples_(samples),
      seed_(seed),
      bodies_(bodies),
      tolerance_(tolerance) {}

std::optional<RobotSpec> RepairCheck::MakeRepaired(std::span<const Repair> causes) const {
  RobotSpec spec = original_;
  for (const Repair& cause : causes) Apply(cause, &spec);
  try {
    static_cast<void>(RobotModel(spec));
  } catch (const InputError&) {
    return std::nullopt;
  }
  return spec;
}

bool RepairCheck::RepairsNumber(const Parameter& parameter, const Trial& trial) const {
  const bool differs = std::find(trial.wrong.begin(), trial.wrong.end(), parameter) != trial.wrong.end();
  if (parameter.index < 0 && !trial.axle_right &&
      (IsGeometric(parameter.kind) || parameter.kind == Kind::kCom || parameter.kind == Kind::kInertia))
    return false;
  if (IsGeometric(parameter.kind)) return trial.IsLinkRight(CarrierOf(trial.spec, parameter));
  if (!bodies_ && IsDynamic(parameter.kind)) return trial.forces_agree;
  if (parameter.kind == Kind::kCom || parameter.kind == Kind::kInertia)
    return !differs && IsPlaced(trial.placement, parameter.index);
  return !differs;
}

bool RepairCheck::Repairs(const Repair& cause, const Trial& trial) const {
  switch (cause.kind) {
    case RepairKind::kEngineOnly:
      return true;
    case RepairKind::kAxisReversed:
      return trial.IsLinkRight(cause.joint);
    case RepairKind::kRowsSwapped:
    case RepairKind::kPosesSwapped:
      return trial.IsLinkRight(cause.joint) && trial.IsLinkRight(cause.other);
    case RepairKind::kParameters:
      break;
  }
  return std::all_of(cause.parameters.begin(), cause.parameters.end(),
                     [&](const Parameter& parameter) { return RepairsNumber(parameter, trial); });
}

void RepairCheck::KeepWhatRepairs(std::vector<Repair>* causes) const {
  const auto make_trial = [&](const RobotSpec& spec) {
    return Trial(spec, engine_, source_, samples_, seed_, bodies_, tolerance_);
  };
  while (!causes->empty()) {
    const std::optional<RobotSpec> spec = MakeRepaired(*causes);
    if (!spec) {
      causes->pop_back();
      continue;
    }
    const Trial trial = make_trial(*spec);
    const size_t dropped =
        std::erase_if(*causes, [&](const Repair& cause) { return !Repairs(cause, trial); });
    if (dropped == 0) break;
  }
  for (size_t i = 0; i < causes->size(); ++i) {
    if ((*causes)[i].equivalents.empty()) continue;
    std::vector<Repair> others = *causes;
    std::erase_if((*causes)[i].equivalents, [&](const Repair& equivalent) {
      others[i] = equivalent;
      const std::optional<RobotSpec> spec = MakeRepaired(others);
      if (!spec) return true;
      const Trial trial = make_trial(*spec);
      return !std::all_of(others.begin(), others.end(),
                          [&](const Repair& cause) { return Repairs(cause, trial); });
    });
  }
}

}  // namespace dexcheck
