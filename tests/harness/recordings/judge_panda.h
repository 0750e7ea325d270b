#pragma once

// Recordings of the Panda that MuJoCo moves, judged by its analytic model.

#include <string>
#include <vector>

#include "harness/descriptions/read_description.h"
#include "harness/recordings/judge_recordings.h"
#include "tests/common/paths.h"
#include "tests/harness/recordings/recorded_robot.h"

namespace dexcheck::testing {

inline constexpr const char* kMjcf = "mjcf/panda.xml";

inline const RobotModel& Panda() {
  static const RobotModel model(ReadDescription(SourcePath("/controller/parameters/panda.toml")).spec);
  return model;
}

inline RecordingJudgement Judge(const RecordedTable& table) {
  std::vector<Recording> recordings;
  recordings.push_back(ToRecording(Panda(), table));
  return JudgeRecordings(Panda(), &recordings, {});
}

inline std::string Tell(const RecordingJudgement& judgement) {
  std::string text;
  for (const Explanation& one : judgement.causes) text += "\n    " + one.Tell();
  return text.empty() ? (judgement.Agrees() ? " explained" : " not explained") : text;
}

}  // namespace dexcheck::testing
