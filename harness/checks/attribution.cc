#include "harness/checks/attribution.h"

#include <algorithm>
#include <string_view>

#include "controller/common/text.h"
#include "harness/checks/check_table.h"

namespace dexcheck {
namespace {

bool Failed(std::span<const CheckRecord> checks, std::string_view name) {
  return std::any_of(checks.begin(), checks.end(),
                     [&](const CheckRecord& check) { return check.name == name && check.failed; });
}

/// What the failure of a check means; nothing for one that has no entry.
FailureMeaning MeaningOf(const CheckRecord& check) {
  const CheckInfo* info = FindCheck(check.name);
  return info == nullptr ? FailureMeaning{} : info->meaning;
}

std::string Tell(const CheckRecord& check) {
  return check.name + " " + FormatNumber(check.worst, 3) + (check.unit == "1" ? "" : " " + check.unit) +
         " (bound " + FormatNumber(check.bound, 3) +
         "), first above it at t = " + FormatNumber(check.failed_at, 3) + " s" +
         (check.part.empty() ? "" : ", " + check.part);
}

/// Whether `check` tells more of the cause than `other`: by rank, then by time, then by precedence.
bool TellsMore(const CheckRecord& check, const CheckRecord& other) {
  const FailureMeaning a = MeaningOf(check);
  const FailureMeaning b = MeaningOf(other);
  if (a.rank != b.rank) return a.rank < b.rank;
  if (check.failed_at != other.failed_at) return check.failed_at < other.failed_at;
  return a.precedence < b.precedence;
}

/// The failed check that tells why; null when none tells.
const CheckRecord* FindEvidence(std::span<const CheckRecord> steps) {
  const CheckRecord* first = nullptr;
  for (const CheckRecord& check : steps) {
    if (!check.failed || MeaningOf(check).cause == Cause::kNone) continue;
    if (first == nullptr || TellsMore(check, *first)) first = &check;
  }
  // What slides in the step in which a force shows tells more than the force. Wheels of another size give
  // other forces besides, which show before they have rolled far; wheels that slide do too.
  if (first == nullptr || first->name != "inverse_dynamics_robot") return first;
  for (const std::string_view slides :
       {"cone_use", "traction_use", "foot_cone_use", "contacts_lost", "feet_lost"}) {
    for (const CheckRecord& check : steps) {
      if (check.name == slides && check.failed && check.failed_at <= first->failed_at) return &check;
    }
  }
  if (!Failed(steps, "rolling") || Failed(steps, "traction_use")) return first;
  return &*std::find_if(steps.begin(), steps.end(),
                        [&](const CheckRecord& check) { return check.name == "rolling"; });
}

/// Whether torques that were cut off explain the check. Motions follow from them; forces that do not balance,
/// or are not the rigid model's, do not: what was delivered is known.
bool ComesFromLimit(const CheckRecord* first, const MeasuredCauses& measured) {
  if (!measured.limited || !measured.limited->failed) return false;
  if (first == nullptr) return true;
  const bool is_motion = first->kind == CheckCategory::kLaw || first->kind == CheckCategory::kAssumption;
  return is_motion && TellsMore(*measured.limited, *first);
}

/// What an expectation that alone fails comes from: the gains, if (57) by itself leaves most of the error,
/// and what drives it otherwise. By algebra that is what contacts give, or what the scenario asks for of the
/// plant.
Cause AttributeExpectation(const CheckRecord& check, const MeasuredCauses& measured, std::string* evidence) {
  const bool position = check.name == "expect_position";
  const double by_law = position ? measured.position_by_law : measured.orientation_by_law;
  const Cause other = measured.is_ideal ? Cause::kControlLaw : Cause::kDeclared;
  if (by_law < 0.0) return other;
  *evidence += "; (57) by itself leaves " + FormatNumber(by_law, 3) + " " + check.unit;
  if (by_law >= 0.5 * check.worst) return Cause::kControlLaw;
  *evidence += measured.is_ideal
                   ? ", contacts that give the rest"
                   : ", contacts that give and what the scenario declares of the plant the rest";
  return measured.is_ideal ? Cause::kContactSoftness : Cause::kDeclared;
}

Cause AttributeOne(const CheckRecord& check, Cause run, std::span<const CheckRecord> steps) {
  if (run == Cause::kModel || run == Cause::kSensing) return run;
  if (check.kind == CheckCategory::kModel) return Cause::kModel;
  const FailureMeaning meaning = MeaningOf(check);
  if (!meaning.is_own) return run;
  return Failed(steps, meaning.sharper) ? FindCheck(meaning.sharper)->meaning.cause : meaning.cause;
}

}  // namespace

const std::string& FindMeasured(Cause cause, const MeasuredCauses& measured) {
  static const std::string kNothing;
  switch (cause) {
    case Cause::kControlLaw:
      return measured.law;
    case Cause::kActuator:
      return measured.motors;
    case Cause::kSensing:
      return measured.sensors;
    case Cause::kUnmodelledForce:
    case Cause::kSlope:
      return measured.force;
    case Cause::kContactGeometry:
      return measured.contacts;
    case Cause::kWheelGeometry:
      return measured.wheels;
    default:
      return kNothing;
  }
}

const char* NameOf(Cause cause) {
  switch (cause) {
    case Cause::kNone:
      return "none";
    case Cause::kModel:
      return "model";
    case Cause::kSensing:
      return "sensing";
    case Cause::kControlLaw:
      return "control law";
    case Cause::kActuator:
      return "actuator";
    case Cause::kActuatorLimit:
      return "actuator limit";
    case Cause::kJointLimit:
      return "joint limit";
    case Cause::kFingertipSlip:
      return "fingertip slip";
    case Cause::kFootSlip:
      return "foot slip";
    case Cause::kWheelSlip:
      return "wheel slip";
    case Cause::kContactSoftness:
      return "contact softness";
    case Cause::kTilt:
      return "tilt";
    case Cause::kSolver:
      return "solver";
    case Cause::kUnmodelledForce:
      return "unmodelled force";
    case Cause::kIntegrator:
      return "integrator";
    case Cause::kSlope:
      return "slope";
    case Cause::kContactGeometry:
      return "contact geometry";
    case Cause::kWheelGeometry:
      return "wheel geometry";
    case Cause::kCollision:
      return "collision";
    case Cause::kFingertipRim:
      return "fingertip rim";
    case Cause::kDeclared:
      return "declared imperfections";
    case Cause::kUnexplained:
      return "unexplained";
  }
  return "none";
}

AttributionResult Attribute(const ConstantChecks& constants, std::span<const CheckRecord> model,
                            std::span<const CheckRecord> steps, const MeasuredCauses& measured) {
  AttributionResult result;
  const CheckRecord* first_model = nullptr;
  for (const CheckRecord& check : model) {
    if (check.failed && (first_model == nullptr || check.failed_at < first_model->failed_at)) {
      first_model = &check;
    }
  }
  const bool any_step =
      std::any_of(steps.begin(), steps.end(), [](const CheckRecord& c) { return c.failed; });
  if (!constants.findings.empty()) {
    const ConstantFinding& finding = constants.findings.front();
    result.cause = Cause::kModel;
    result.evidence = finding.check + ": " + finding.where + ": " + FormatNumber(finding.model) +
                      " in the model, " + FormatNumber(finding.engine) + " in the MJCF";
  } else if (first_model != nullptr && !Failed(steps, "measurement")) {
    result.cause = Cause::kModel;
    result.evidence = Tell(*first_model);
  } else if (any_step) {
    const CheckRecord* first = FindEvidence(steps);
    if (ComesFromLimit(first, measured)) first = &*measured.limited;
    if (first != nullptr) {
      result.cause = MeaningOf(*first).cause;
      result.evidence = Tell(*first);
      if (result.cause == Cause::kUnmodelledForce && measured.is_slope) result.cause = Cause::kSlope;
      result.check = first->name;
      const FailureMeaning meaning = MeaningOf(*first);
      if (meaning.rank == Rank::kResidual && meaning.cause == Cause::kControlLaw) {
        result.cause = AttributeExpectation(*first, measured, &result.evidence);
      } else if (const std::string& how = FindMeasured(result.cause, measured); !how.empty()) {
        result.evidence += "; " + how;
      }
    } else {
      result.cause = Cause::kUnexplained;
      const auto assumption = std::find_if(steps.begin(), steps.end(), [](const CheckRecord& check) {
        return check.failed && check.kind == CheckCategory::kAssumption;
      });
      result.evidence = assumption == steps.end() ? "no assumption broke" : Tell(*assumption);
    }
  }
  for (const std::span<const CheckRecord> checks : {model, steps}) {
    for (const CheckRecord& check : checks) {
      if (check.failed) {
        result.attributions.push_back({check.name, AttributeOne(check, result.cause, steps)});
      }
    }
  }
  return result;
}

}  // namespace dexcheck
