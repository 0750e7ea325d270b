#pragma once

// Two recordings of one robot: how far they are apart, and what of the robot differs.

#include <optional>
#include <string>
#include <vector>

#include "harness/recordings/judge_recordings.h"

namespace dexcheck {

/// Root mean squares of the second's less the first's at the same times, after the second was moved by
/// `delay`.
struct JointDifference {
  int joint = -1;
  double position = 0.0;  ///< rad or m
  double torque = 0.0;    ///< N m or N
};

/// A cause that one of them has, or both with other sizes.
struct CauseDifference {
  std::optional<Fault> first, second;
  /// "joint elbow: dry friction 0.3 +- 0.01 N m in the second, none in the first".
  [[nodiscard]] std::string Describe() const;
};

struct RecordingComparison {
  RecordingJudgement first, second;
  bool is_same_motion = false;          ///< Whether the positions agree; otherwise only causes are compared.
  double delay = 0.0;                   ///< Of the second against the first, s.
  std::vector<JointDifference> joints;  ///< None of different motions.
  std::vector<CauseDifference> causes;
};

/// @param recordings two. @throws InputError as JudgeRecordings.
RecordingComparison CompareRecordings(const RobotModel& model, std::vector<Recording>* recordings,
                                      const JudgeOptions& options,
                                      const std::function<bool(long rows)>& on_rows = {});

}  // namespace dexcheck
