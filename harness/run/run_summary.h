#pragma once

// Summary of a run: verdict, tracking, checks, attribution, speed.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/diagnosis/attribution.h"
#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/run/closed_loop.h"
#include "harness/run/sampled_loop.h"

namespace dexcheck {

enum class Verdict { kPass, kDisagreement, kFailed };

/// "pass", "disagreement", "failed".
const char* NameOf(Verdict verdict);

/// Statistics of the object's tracking error.
class TrackingStatistics {
 public:
  void Add(const TrackingError& error);
  [[nodiscard]] double position_max() const { return position_max_; }
  [[nodiscard]] double position_rms() const;
  [[nodiscard]] double orientation_max() const { return orientation_max_; }
  [[nodiscard]] double orientation_rms() const;
  /// Largest error of a joint, rad or m.
  [[nodiscard]] double joints_max() const { return joints_max_; }
  [[nodiscard]] double joints_rms() const;

 private:
  double position_max_ = 0.0;
  double position_squares_ = 0.0;
  double orientation_max_ = 0.0;
  double orientation_squares_ = 0.0;
  double joints_max_ = 0.0;
  double joints_squares_ = 0.0;
  long count_ = 0;
};

/// Torque that a motor's limit cut off.
struct LimitedTorque {
  double time = 0.0;   ///< Total duration, s.
  double first = 0.0;  ///< Time of its beginning, s.
  double most = 0.0;   ///< N m, N.
};

/// A finished run, or a run up to its failure.
struct RunResult {
  Verdict verdict = Verdict::kPass;
  std::string failure;             ///< Reason of an early end; empty when there was none.
  bool interrupted = false;        ///< Whether the user ended the run.
  bool grasp_lost = false;         ///< Whether it ended because a fingertip left the object.
  bool controller_failed = false;  ///< Whether it ended because a controller of the user's own failed.
  TrackingStatistics tracking;
  double peak_effort = 0.0;             ///< Largest |tau'| sent over its motor's limit.
  std::string busiest_motor;            ///< Motor with that effort.
  std::vector<LimitedTorque> limited;   ///< By entry of tau'; empty where torques arrive as they are sent.
  std::optional<JointMargins> margins;  ///< Margins of a motion of joints, after JudgeGains.
  std::string gain_card;                ///< Gains as TOML, after JudgeGains.
  AttributionResult attribution;
  Causes causes;  ///< Causes that explain the residuals, and the facts that checks observed.
  double recording_seconds = 0.0;
  double wall_seconds = 0.0;  ///< Time of all steps, recording included.
};

/// Adds a step of dt (s).
void AddLimits(const StepRecord& step, double dt, std::vector<LimitedTorque>* limited);

/// Sets the verdict and its attribution. Call when the last step is done.
void Judge(const Setup& setup, const ClosedLoop& loop, const SearchOptions& search, RunResult* result);

/// Returns the summary with the keys that README.md lists for summary.json; lengths m, angles rad.
nlohmann::ordered_json MakeSummary(const Setup& setup, const ClosedLoop& loop, const RunResult& result);

}  // namespace dexcheck
