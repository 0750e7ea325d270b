#include "harness/checks/attribution.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <string_view>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

const RunCheck* Find(std::span<const RunCheck> checks, std::string_view name) {
  for (const RunCheck& check : checks) {
    if (check.name == name) return &check;
  }
  return nullptr;
}

bool Failed(std::span<const RunCheck> checks, std::string_view name) {
  const RunCheck* check = Find(checks, name);
  return check != nullptr && check->failed;
}

std::string FormatShort(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g", value);
  return text;
}

std::string Tell(const RunCheck& check) {
  return check.name + " " + FormatShort(check.max) + (check.unit == "1" ? "" : " " + check.unit) +
         " (bound " + FormatShort(check.bound) + "), first above it at t = " + FormatShort(check.failed_at) +
         " s" + (check.where.empty() ? "" : ", " + check.where);
}

/// A check whose failure means its cause by itself.
struct Evidence {
  const char* check;
  Cause cause;
};

// Sliding before giving before tilting: a tyre that spins also tilts the platform.
constexpr Evidence kEvidence[] = {
    {"actuator_effort", Cause::kActuatorLimit},
    {"joint_stop", Cause::kJointStop},
    {"cone_use", Cause::kFingertipSlip},
    {"traction_use", Cause::kWheelSlip},
    {"contacts_lost", Cause::kFingertipSlip},
    {"penetration", Cause::kContactSoftness},
    {"fingertip_slip", Cause::kContactSoftness},
    {"fingertip_slip_rate", Cause::kContactSoftness},
    {"wheel_slip", Cause::kContactSoftness},
    {"wheel_slip_rate", Cause::kContactSoftness},
    {"kappa", Cause::kContactSoftness},
    {"unjudged", Cause::kContactSoftness},
    {"solver", Cause::kSolver},
    {"base_tilt", Cause::kTilt},
};

constexpr bool IsDecisive(Cause cause) {
  return cause == Cause::kActuatorLimit || cause == Cause::kJointStop || cause == Cause::kFingertipSlip ||
         cause == Cause::kWheelSlip;
}

/// The evidence that came first among those of the strongest sort.
const RunCheck* FindFirst(std::span<const RunCheck> steps, Cause* cause) {
  const RunCheck* first = nullptr;
  for (const bool decisive : {true, false}) {
    for (const Evidence& evidence : kEvidence) {
      if (IsDecisive(evidence.cause) != decisive) continue;
      const RunCheck* check = Find(steps, evidence.check);
      if (check == nullptr || !check->failed) continue;
      if (first != nullptr && check->failed_at >= first->failed_at) continue;
      first = check;
      *cause = evidence.cause;
    }
    if (first != nullptr) return first;
  }
  return nullptr;
}

/// Checks of a contact that have a cause of their own, whatever else happens in the run.
Cause AttributeOne(const RunCheck& check, Cause run, std::span<const RunCheck> steps) {
  if (check.kind == CheckKind::kModel || run == Cause::kModel) return Cause::kModel;
  if (check.name == "actuator_effort") return Cause::kActuatorLimit;
  if (check.name == "joint_stop") return Cause::kJointStop;
  if (check.name == "solver") return Cause::kSolver;
  if (check.name == "wheel_slip" || check.name == "wheel_slip_rate" || check.name == "traction_use") {
    return Failed(steps, "traction_use") ? Cause::kWheelSlip : Cause::kContactSoftness;
  }
  if (check.name == "contacts_lost") return Cause::kFingertipSlip;
  if (check.name == "fingertip_slip" || check.name == "fingertip_slip_rate" || check.name == "cone_use") {
    return Failed(steps, "cone_use") ? Cause::kFingertipSlip : Cause::kContactSoftness;
  }
  if (check.name == "penetration") return Cause::kContactSoftness;
  return run;
}

}  // namespace

const char* NameOf(Cause cause) {
  switch (cause) {
    case Cause::kNone:
      return "none";
    case Cause::kModel:
      return "model";
    case Cause::kActuatorLimit:
      return "actuator limit";
    case Cause::kJointStop:
      return "joint stop";
    case Cause::kFingertipSlip:
      return "fingertip slip";
    case Cause::kWheelSlip:
      return "wheel slip";
    case Cause::kContactSoftness:
      return "contact softness";
    case Cause::kTilt:
      return "tilt";
    case Cause::kSolver:
      return "solver";
    case Cause::kIntegrator:
      return "integrator";
  }
  return "none";
}

AttributionResult Attribute(const GateResult& gate, std::span<const RunCheck> model,
                            std::span<const RunCheck> steps) {
  AttributionResult result;
  const RunCheck* first_model = nullptr;
  for (const RunCheck& check : model) {
    if (check.failed && (first_model == nullptr || check.failed_at < first_model->failed_at)) {
      first_model = &check;
    }
  }
  const bool any_step = std::any_of(steps.begin(), steps.end(), [](const RunCheck& c) { return c.failed; });
  if (!gate.findings.empty()) {
    const GateFinding& finding = gate.findings.front();
    result.cause = Cause::kModel;
    result.evidence = finding.check + ": " + finding.where + ": " + FormatNumber(finding.model) +
                      " in the model, " + FormatNumber(finding.engine) + " in the MJCF";
  } else if (first_model != nullptr) {
    result.cause = Cause::kModel;
    result.evidence = Tell(*first_model);
  } else if (any_step) {
    // The object's balance has no other unknowns than the model's: its inertia and the contacts' geometry.
    const RunCheck* object = Find(steps, "balance_object");
    if (object != nullptr && object->failed) {
      result.cause = Cause::kModel;
      result.evidence = Tell(*object);
    } else if (const RunCheck* first = FindFirst(steps, &result.cause)) {
      result.evidence = Tell(*first);
    } else {
      result.cause = Cause::kIntegrator;
      const auto assumption = std::find_if(steps.begin(), steps.end(), [](const RunCheck& check) {
        return check.failed && check.kind == CheckKind::kAssumption;
      });
      result.evidence = assumption == steps.end() ? "no assumption broke" : Tell(*assumption);
    }
  }
  for (const std::span<const RunCheck> checks : {model, steps}) {
    for (const RunCheck& check : checks) {
      if (check.failed) {
        result.attributions.push_back({check.name, AttributeOne(check, result.cause, steps)});
      }
    }
  }
  return result;
}

}  // namespace dexcheck
