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
constexpr int kNumOutcomes = 9;

/// "tracked", "slipped", ...
const char* NameOf(Outcome outcome);
std::optional<Outcome> FindOutcome(std::string_view name);
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
    {"cone_margin", "N", "least mu f_n - |f_t| of a fingertip"},
    {"fingertip_slip", "m", "how far a fingertip slid"},
    {"wheel_slip", "m", "how far a wheel slid"},
    {"simulated_time", "s", "how far the run came"},
    {"joint_error_rms", "rad",
     "of a motion of joints: at each step the joint that is farthest from its place"},
    {"joint_error_max", "rad", "the largest"},
    {"gain_margin", "1",
     "of a motion of joints: least factor above 1 of one joint's torque that is unstable"},
    {"phase_margin", "rad", "likewise, least lag or lead"},
    {"delay_margin", "s", "likewise, least delay"},
}};

/// Outcome and metrics; NaN where a metric does not exist.
struct TrialResult {
  Outcome outcome = Outcome::kTracked;
  std::string failure;  ///< Why the run ended early; empty when it did not.
  std::array<double, kNumMetrics> metrics{};
};

}  // namespace dexcheck
