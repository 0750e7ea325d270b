#pragma once

// Why a run's checks failed: the model, or which assumption about the plant.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/checks/failure_cause.h"
#include "harness/descriptions/constant_checks.h"

namespace dexcheck {

/// One failed check with its cause.
struct Attribution {
  std::string check;
  Cause cause = Cause::kNone;
};

/// What was measured of the causes that it can be measured of, in words: which part, and how much.
struct MeasuredCauses {
  std::string law;        ///< Which summand of (55), and its factor.
  std::string motors;     ///< Which motor, and its gain, delay, offset or friction.
  std::string sensors;    ///< Which reading, and how much.
  std::string force;      ///< On which joint or body, and how large.
  std::string wheels;     ///< Which radius or distance.
  std::string contacts;   ///< Which radius.
  bool is_slope = false;  ///< The force is gravity's, which does not point down.
  /// Largest errors of the object that (57) by itself would leave while the expectations are asked, m and
  /// rad: below zero where it is not integrated.
  double position_by_law = -1.0, orientation_by_law = -1.0;
  bool is_ideal = true;  ///< The scenario declares no imperfection of the plant.
  /// `actuator_effort` where the scenario lets torques be cut off: no fault, but what others may come from.
  std::optional<CheckRecord> limited;
};

struct AttributionResult {
  Cause cause = Cause::kNone;             ///< Of the run: the one that the others follow from.
  std::string evidence;                   ///< In words: which check says so, with its value and time.
  std::string check;                      ///< The check of a step that says so; empty for one of the model.
  std::vector<Attribution> attributions;  ///< Of each failed check.
};

/// Attributes the failed checks of a run. Model checks compare both sides at one and the same state: when one
/// fails, the model is the cause of everything else. Otherwise the cause is the assumption that broke first;
/// sliding shows at the edge of the friction cone, and tells slip from contacts that merely give.
/// @param model checks of the first question.
/// @param measured what was found out beside the checks.
AttributionResult Attribute(const ConstantChecks& constants, std::span<const CheckRecord> model,
                            std::span<const CheckRecord> steps, const MeasuredCauses& measured = {});

/// What was measured of a cause; empty when nothing was.
const std::string& FindMeasured(Cause cause, const MeasuredCauses& measured);

}  // namespace dexcheck
