#pragma once

// The motion of a judged recording, for the replay in its page.

#include <filesystem>
#include <optional>

#include "harness/recordings/judge_recordings.h"
#include "harness/report/replay.h"

namespace dexcheck {

/// What a page counts a recording's times from: its begin where it is one of several, or has a clock's time;
/// otherwise 0.
double FindTimeBegin(const RecordingJudgement& judgement, int recording);

/// The first recording's: with the shapes of an MJCF, otherwise with rods between the joints. None for a
/// robot with ball joints or a base that moves.
/// @param file that the model was read from.
std::optional<ReplayData> MakeMotionReplay(const RobotModel& model, const std::filesystem::path& file,
                                           const RecordingJudgement& judgement);

}  // namespace dexcheck
