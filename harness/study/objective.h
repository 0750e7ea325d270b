#pragma once

// The wishes of a study: objectives and constraints as expressions of metrics, judged over all trials of a
// point.

#include <span>
#include <string>
#include <vector>

#include "harness/study/trial_result.h"

namespace dexcheck {

/// How one value is made of an objective's values at the trials of one point, one for each seed.
enum class Aggregate { kMean, kWorst, kQuantile };

/// An expression of metrics that is to be small, or large.
struct Objective {
  std::string expression;  ///< Of names of metrics, as EvaluateExpression takes it.
  bool maximize = false;
  Aggregate aggregate = Aggregate::kMean;
  double quantile = 0.5;  ///< Of kQuantile: this fraction of the trials is at least as good.
  bool operator==(const Objective&) const = default;
};

/// "position_error_rms, worst of its trials".
std::string Describe(const Objective& objective);

/// " m" of a metric in metres; nothing of one without a unit, and of an expression that is no metric by
/// itself.
std::string ShowUnit(const std::string& expression);

/// Something that must hold at a point's trials.
struct Constraint {
  enum class Kind { kLess, kOutcomeIs, kOutcomeIsNot, kHeld };
  std::string text;  ///< As the study has it.
  Kind kind = Kind::kHeld;
  std::string less, more;  ///< Of kLess: expressions, less <= more.
  Outcome outcome = Outcome::kTracked;
  double fraction = 1.0;  ///< At this fraction of the trials at least.
  bool operator==(const Constraint&) const = default;
};

/// "peak_effort < 0.8", "outcome == tracked", "verdict == pass" (which is the same), "held" (to its end, in
/// the hand).
/// @throws std::invalid_argument that says what is wrong.
Constraint ParseConstraint(const std::string& text);

/// @throws std::invalid_argument when this is no arithmetic of metrics.
void RequireMetricExpression(const std::string& expression);

/// Value of an expression; NaN where one of its metrics is.
double EvaluateMetrics(const std::string& expression, const TrialResult& result);

/// How far one trial violates a constraint: 0 where it holds, at most 1, more for trials that were not held,
/// the more the earlier they ended.
double CalcViolation(const Constraint& constraint, const TrialResult& result);

/// The judgement of a point.
struct Judgement {
  std::vector<double>
      objectives;  ///< To be minimised (of `maximize` with the other sign); infinite where a trial failed.
  double violation = 0.0;  ///< 0 when all constraints hold.
  [[nodiscard]] bool is_feasible() const { return violation <= 0.0; }
};

/// @param results of all trials of the point, in the order of their numbers. A point at which a trial was not
/// held is
///   not feasible unless a constraint of kind kHeld says which fraction may fail.
Judgement JudgePoint(const std::vector<Objective>& objectives, const std::vector<Constraint>& constraints,
                     std::span<const TrialResult> results);

/// Whether `a` is to be preferred: feasible before not, less violation before more, then (one objective) the
/// less.
bool IsBetter(const Judgement& a, const Judgement& b);

/// Whether `a` is feasible, nowhere worse than `b`, and somewhere better; or `b` is not feasible and `a` is.
bool Dominates(const Judgement& a, const Judgement& b);

}  // namespace dexcheck
