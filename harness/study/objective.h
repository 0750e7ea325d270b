#pragma once

// The wishes of a study: objectives and constraints as expressions of metrics, judged over all trials of a
// point.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace dexcheck {

// The result of a trial.

enum class Outcome {
  kTracked,          ///< Held to the end, without slip, the error bounded.
  kSlipped,          ///< A fingertip slid.
  kLostContact,      ///< A fingertip left the object: the end of the run.
  kWheelsSpun,       ///< A wheel slid.
  kDiverged,         ///< The error grew, or a motor, the grasp force or the engine gave up.
  kChecksDisagreed,  ///< Model and engine differ at one and the same state.
  kRefused,          ///< The values make no run, such as a grasp out of reach.
  kCrashed,          ///< The trial's process died.
  kTimedOut,         ///< It took longer than the study allows, and was ended.
};
struct OutcomeInfo {
  const char* name;
  bool is_held;       ///< The run came to its end with the object in the hand.
  const char* color;  ///< On pages.
};

/// By Outcome.
inline constexpr std::array<OutcomeInfo, 9> kOutcomes = {{
    {"tracked", true, "#7bb662"},
    {"slipped", true, "#f2c14e"},
    {"lost contact", false, "#e4572e"},
    {"wheels spun", true, "#f78154"},
    {"diverged", false, "#9b2226"},
    {"checks disagreed", true, "#577590"},
    {"refused", false, "#cccccc"},
    {"crashed", false, "#000000"},
    {"timed out", false, "#6d597a"},
}};

/// "tracked", "slipped", ...
inline const char* NameOf(Outcome outcome) { return kOutcomes[static_cast<size_t>(outcome)].name; }

/// Whether a run came to its end with the object in the hand.
inline bool IsHeld(Outcome outcome) { return kOutcomes[static_cast<size_t>(outcome)].is_held; }

/// Whether a trial came to no result of its own, so that it may be tried again.
constexpr bool IsFailed(Outcome outcome) {
  return outcome == Outcome::kCrashed || outcome == Outcome::kTimedOut;
}

enum Metric {
  kPositionErrorRms,
  kPositionErrorMax,
  kOrientationErrorRms,
  kOrientationErrorMax,
  kSettlingTime,
  kOvershoot,
  kErrorGrowth,
  kPeakTorque,
  kPeakEffort,
  kEnergy,
  kConeMargin,
  kFingertipSlip,
  kWheelSlip,
  kSimulatedTime,
  kJointErrorRms,
  kJointErrorMax,
  kGainMargin,
  kPhaseMargin,
  kDelayMargin,
  kNumMetrics
};

struct MetricInfo {
  const char* name;
  const char* unit;
  bool is_better_large = false;
};

/// By Metric; shipped/studies/README.md says what each is.
inline constexpr std::array<MetricInfo, kNumMetrics> kMetrics = {{
    {"position_error_rms", "m"},
    {"position_error_max", "m"},
    {"orientation_error_rms", "rad"},
    {"orientation_error_max", "rad"},
    {"settling_time", "s"},
    {"overshoot", "1"},
    {"error_growth", "1"},
    {"peak_torque", "N m"},
    {"peak_effort", "1"},
    {"energy", "J"},
    {"cone_margin", "N", true},
    {"fingertip_slip", "m"},
    {"wheel_slip", "m"},
    {"simulated_time", "s", true},
    {"joint_error_rms", "rad"},
    {"joint_error_max", "rad"},
    {"gain_margin", "1", true},
    {"phase_margin", "rad", true},
    {"delay_margin", "s", true},
}};

namespace detail {

/// The place of a name in a table; none of another.
template <typename Number, typename Table>
std::optional<Number> FindName(const Table& table, std::string_view name) {
  for (size_t i = 0; i < table.size(); ++i) {
    if (name == table[i].name) return static_cast<Number>(i);
  }
  return std::nullopt;
}

}  // namespace detail

/// By its name; none of another.
inline std::optional<Outcome> FindOutcome(std::string_view name) {
  return detail::FindName<Outcome>(kOutcomes, name);
}
inline std::optional<Metric> FindMetric(std::string_view name) {
  return detail::FindName<Metric>(kMetrics, name);
}

/// Outcome and metrics; NaN where a metric does not exist.
struct TrialResult {
  Outcome outcome = Outcome::kTracked;
  std::string failure;  ///< Why the run ended early; empty when it did not.
  std::array<double, kNumMetrics> metrics{};
};

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
