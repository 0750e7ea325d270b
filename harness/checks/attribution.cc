#include "harness/checks/attribution.h"

#include <algorithm>
#include <cstdio>
#include <string_view>

#include "controller/common/text.h"
#include "harness/checks/step_check_table.h"

namespace dexcheck {
namespace {

bool Failed(std::span<const CheckRecord> checks, std::string_view name) {
  return std::any_of(checks.begin(), checks.end(),
                     [&](const CheckRecord& check) { return check.name == name && check.failed; });
}

/// What the failure of a check means; nothing for one that has no entry.
FailureMeaning MeaningOf(const CheckRecord& check) {
  const StepCheckInfo* info = FindStepCheck(check.name);
  return info == nullptr ? FailureMeaning{} : info->meaning;
}

std::string FormatShort(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g", value);
  return text;
}

std::string Tell(const CheckRecord& check) {
  return check.name + " " + FormatShort(check.worst) + (check.unit == "1" ? "" : " " + check.unit) +
         " (bound " + FormatShort(check.bound) + "), first above it at t = " + FormatShort(check.failed_at) +
         " s" + (check.part.empty() ? "" : ", " + check.part);
}

// Sliding before giving before tilting: a tyre that spins also tilts the platform.
constexpr bool IsDecisive(Cause cause) {
  return cause == Cause::kActuatorLimit || cause == Cause::kJointStop || cause == Cause::kFingertipSlip ||
         cause == Cause::kWheelSlip;
}

/// Of the failed checks whose meaning passes, the one that failed first; by precedence at one time.
template <typename Passes>
const CheckRecord* FindFirst(std::span<const CheckRecord> steps, const Passes& passes) {
  const CheckRecord* first = nullptr;
  for (const CheckRecord& check : steps) {
    if (!check.failed || !passes(MeaningOf(check).cause)) continue;
    if (first != nullptr && check.failed_at > first->failed_at) continue;
    if (first != nullptr && check.failed_at == first->failed_at &&
        MeaningOf(check).precedence > MeaningOf(*first).precedence) {
      continue;
    }
    first = &check;
  }
  return first;
}

/// The check that tells why, among those of the strongest sort; null when none tells.
const CheckRecord* FindEvidence(std::span<const CheckRecord> steps) {
  const CheckRecord* first = FindFirst(steps, [](Cause cause) { return cause == Cause::kModel; });
  if (first == nullptr) first = FindFirst(steps, IsDecisive);
  if (first == nullptr) first = FindFirst(steps, [](Cause cause) { return cause != Cause::kNone; });
  return first;
}

Cause AttributeOne(const CheckRecord& check, Cause run, std::span<const CheckRecord> steps) {
  if (check.kind == CheckKind::kModel || run == Cause::kModel) return Cause::kModel;
  const FailureMeaning meaning = MeaningOf(check);
  if (!meaning.is_own) return run;
  if (meaning.sharper == StepCheck::kCount) return meaning.cause;
  const StepCheckInfo& sharper = kStepChecks[static_cast<size_t>(meaning.sharper)];
  return Failed(steps, sharper.name) ? sharper.meaning.cause : meaning.cause;
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

AttributionResult Attribute(const GateResult& gate, std::span<const CheckRecord> model,
                            std::span<const CheckRecord> steps) {
  AttributionResult result;
  const CheckRecord* first_model = nullptr;
  for (const CheckRecord& check : model) {
    if (check.failed && (first_model == nullptr || check.failed_at < first_model->failed_at)) {
      first_model = &check;
    }
  }
  const bool any_step =
      std::any_of(steps.begin(), steps.end(), [](const CheckRecord& c) { return c.failed; });
  if (!gate.findings.empty()) {
    const GateFinding& finding = gate.findings.front();
    result.cause = Cause::kModel;
    result.evidence = finding.check + ": " + finding.where + ": " + FormatNumber(finding.model) +
                      " in the model, " + FormatNumber(finding.engine) + " in the MJCF";
  } else if (first_model != nullptr) {
    result.cause = Cause::kModel;
    result.evidence = Tell(*first_model);
  } else if (any_step) {
    if (const CheckRecord* first = FindEvidence(steps)) {
      result.cause = MeaningOf(*first).cause;
      result.evidence = Tell(*first);
    } else {
      result.cause = Cause::kIntegrator;
      const auto assumption = std::find_if(steps.begin(), steps.end(), [](const CheckRecord& check) {
        return check.failed && check.kind == CheckKind::kAssumption;
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
