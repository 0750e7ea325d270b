#pragma once

// The motion of a judged recording, for the replay in its page.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "harness/recordings/judge_recordings.h"
#include "harness/report/replay.h"

namespace dexcheck {

/// Time from which a page counts a recording's times: its begin where it is one of several, or has a clock's
/// time; otherwise 0.
double FindTimeBegin(const RecordingJudgement& judgement, int recording);

/// The first recording's: with the shapes of an MJCF, otherwise with rods between the joints. None for a
/// robot with ball joints or a base that moves.
/// @param file that the model was read from.
std::optional<ReplayData> MakeMotionReplay(const RobotModel& model, const std::filesystem::path& file,
                                           const RecordingJudgement& judgement);

// The page of a judged recording.

/// A whole HTML document that loads nothing: the verdict, the causes and those that the motion does not
/// distinguish, each joint's torques over time with their residuals and the noise, and the recorded motion.
/// @param model that judged. @param json of the judgement, as `judge --json` writes it.
/// @param replay of the first recording; none where it cannot be drawn.
std::string MakeJudgePage(const RobotModel& model, const RecordingJudgement& judgement,
                          const nlohmann::ordered_json& json, const ReplayData* replay = nullptr);

}  // namespace dexcheck
