#pragma once

// What a trial comes to.

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
  const char* description;
  bool is_better_large = false;
};

/// By Metric.
inline constexpr std::array<MetricInfo, kNumMetrics> kMetrics = {{
    {"position_error_rms", "m", "object against its desired position"},
    {"position_error_max", "m", "the largest"},
    {"orientation_error_rms", "rad", "object against its desired orientation"},
    {"orientation_error_max", "rad", "the largest"},
    {"settling_time", "s", "until the error stays within 2 % of the start error"},
    {"overshoot", "1", "largest error opposite to the start error, relative to it"},
    {"error_growth", "1", "rms error of the last quarter over that of the first"},
    {"peak_torque", "N m", "largest |tau'| of a motor"},
    {"peak_effort", "1", "largest |tau'| of a motor relative to its limit"},
    {"energy", "J", "work of all motors, either sign counted as positive"},
    {"cone_margin", "N", "least mu f_n - |f_t| of a fingertip", true},
    {"fingertip_slip", "m", "how far a fingertip slid"},
    {"wheel_slip", "m", "how far a wheel slid"},
    {"simulated_time", "s", "how far the run came", true},
    {"joint_error_rms", "rad",
     "of a motion of joints: at each step the joint that is farthest from its place"},
    {"joint_error_max", "rad", "the largest"},
    {"gain_margin", "1", "of a motion of joints: least factor above 1 of one joint's torque that is unstable",
     true},
    {"phase_margin", "rad", "likewise, least lag or lead", true},
    {"delay_margin", "s", "likewise, least delay", true},
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
