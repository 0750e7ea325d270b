#pragma once

// The verdict of a judged recording, in the words of terminal, JSON, page and Python.

#include <string>

#include "harness/base/answer.h"
#include "harness/recordings/judge_recordings.h"

namespace dexcheck {

/// Returns EXPLAINED, PARTLY EXPLAINED, NOT EXPLAINED or DIFFERS, with the joints that are not judged, and
/// the causes.
/// @param recording its name.
Answer MakeAnswer(const RecordingJudgement& judgement, const RobotModel& robot, const std::string& recording);

}  // namespace dexcheck
