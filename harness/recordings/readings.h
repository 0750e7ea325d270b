#pragma once

// Recordings are read more than once: a first reading says what the next one should undo or refine.

#include <functional>
#include <vector>

#include "harness/recordings/judge_recordings.h"

namespace dexcheck {

/// A cause that holds during all of a recording.
Explanation MakeCause(const Fault& fault);

using OnRows = std::function<bool(long rows)>;
/// Judges the recordings, which are open, by this model, beside faults that were undone.
using JudgeOnce =
    std::function<RecordingJudgement(const RobotModel&, const Refinements&, bool has_others, const OnRows&)>;

/// Returns the judgement that explains the recordings with the fewest numbers.
RecordingJudgement ReadUntilSettled(const RobotModel& model, std::vector<Recording>* recordings,
                                    const JudgeOptions& options, const OnRows& on_rows,
                                    const JudgeOnce& judge);

}  // namespace dexcheck
