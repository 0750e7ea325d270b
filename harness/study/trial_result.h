#pragma once

// The result of a trial.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace dexcheck {

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

}  // namespace dexcheck
