#pragma once

// Summary of a run: verdict, tracking, checks, attribution, speed.

#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/base/answer.h"
#include "harness/diagnosis/attribution.h"
#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/run/closed_loop.h"
#include "harness/run/sampled_loop.h"

namespace dexcheck {

enum class Verdict { kPass, kDisagreement, kFailed };

/// "pass", "disagreement", "failed".
const char* NameOf(Verdict verdict);

/// Statistics of an error over the steps of a run.
struct ErrorStatistics {
  double max = 0.0;
  double squares = 0.0;  ///< Their sum.
  long count = 0;

  void Add(double size, double square);
  [[nodiscard]] double rms() const;
};

/// Statistics of the tracking errors.
struct TrackingStatistics {
  ErrorStatistics position;     ///< Of the object, m.
  ErrorStatistics orientation;  ///< rad.
  ErrorStatistics joints;       ///< Of the joint that is farthest off, rad or m.

  void Add(const TrackingError& error);
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

/// Returns a run's verdict with its causes, numbered in the order of the summary, and the evidence.
/// @param summary as summary.json has it, of this or an older version. @param checks all that were made; none
/// of a run that was not checked.
Answer MakeRunAnswer(const nlohmann::ordered_json& summary, std::span<const CheckRecord> checks);

}  // namespace dexcheck
