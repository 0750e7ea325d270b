#pragma once

// Why a run's checks failed: facts that checks observed and faults that explain residuals, in one list.

#include <span>
#include <string>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/checks/failure_cause.h"
#include "harness/checks/run_checks.h"
#include "harness/comparison/constant_checks.h"
#include "harness/diagnosis/causes.h"

namespace dexcheck {

/// One failed check with its cause.
struct Attribution {
  std::string check;
  Cause cause = Cause::kNone;
};

struct AttributionResult {
  Cause cause = Cause::kNone;             ///< Of the run: the one that the others follow from.
  std::string evidence;                   ///< In words: which check says so, with its value and time.
  std::string check;                      ///< The check of a step that says so; empty for one of the model.
  std::vector<Attribution> attributions;  ///< Of each failed check.
};

/// From when on how wheels roll is no fault's, s; endless for never: wheels slide, the solver stopped early,
/// or two bodies touch that should not.
double FindVoid(std::span<const CheckRecord> steps);

/// Attributes the failed checks of a run. Model checks compare both sides at one and the same state: when one
/// fails, the model is the cause of everything else. Otherwise the cause is what came first of what is
/// decisive, a fault or an observed fact; sliding shows at the edge of the friction cone, and distinguishes
/// slip from contacts that merely give.
/// @param model checks of the model's terms. @param causes faults that explain the residuals; gets the facts,
/// and is ranked: the first one is the run's cause, unless the scenario declares what makes it.
AttributionResult Attribute(const ConstantChecks& constants, std::span<const CheckRecord> model,
                            std::span<const CheckRecord> steps, const CheckContext& context, Causes* causes);

}  // namespace dexcheck
