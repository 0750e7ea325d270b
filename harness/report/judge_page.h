#pragma once

// The page of a judged recording.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "harness/recordings/judge_recordings.h"
#include "harness/report/replay.h"

namespace dexcheck {

/// A whole HTML document that loads nothing: the verdict, the causes and what the motion does not tell apart,
/// each joint's torques over time with what is left of them and the noise, and the recorded motion.
/// @param model that judged. @param json of the judgement, as `judge --json` writes it.
/// @param replay of the first recording; none where it cannot be drawn.
std::string MakeJudgePage(const RobotModel& model, const RecordingJudgement& judgement,
                          const nlohmann::ordered_json& json, const ReplayData* replay = nullptr);

}  // namespace dexcheck
