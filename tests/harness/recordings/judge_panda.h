#pragma once

// Recordings of the Panda that MuJoCo moves, judged by its analytic model.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
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
  for (const Explanation& one : judgement.causes) text += "\n    " + one.Describe();
  return text.empty() ? (judgement.Agrees() ? " explained" : " not explained") : text;
}

/// A recording with faults, all else by default.
inline RecordedTable Record(const std::vector<RecordedFault>& faults, bool has_velocities = false,
                            unsigned seed = 3) {
  std::mt19937 random(seed);
  RecordingOptions options;
  options.has_velocities = has_velocities;
  return RecordRobot(kMjcf, faults, options, &random);
}

/// The only cause is this one, and is named.
inline ::testing::AssertionResult NamesOnly(const RecordingJudgement& judgement, const std::string& fault,
                                            const std::string& place, double value) {
  const bool is_named = judgement.causes.size() == 1 && judgement.causes[0].outcome == CauseOutcome::kNamed &&
                        judgement.causes[0].faults[0].fault == fault &&
                        judgement.causes[0].faults[0].place == place &&
                        std::abs(judgement.causes[0].faults[0].value - value) < 0.05 * std::abs(value);
  return is_named ? ::testing::AssertionSuccess() : ::testing::AssertionFailure() << Tell(judgement);
}

}  // namespace dexcheck::testing
