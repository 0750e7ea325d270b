#pragma once

// The verdict of a judged recording, in the words of terminal, JSON, page and Python.

#include <string>

#include "harness/recordings/judge_recordings.h"

namespace dexcheck {

struct JudgementVerdict {
  std::string word;      ///< "explained", "partly explained", "not explained" or "differs".
  std::string sentence;  ///< Ends with the joints that are not judged, and why.
};

/// @param recording its name.
JudgementVerdict MakeVerdict(const RecordingJudgement& judgement, const RobotModel& model,
                             const std::string& recording);

}  // namespace dexcheck
