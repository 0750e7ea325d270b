// The motion of a recording: rods of a table of joints stand where the engine's links do.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "harness/descriptions/read_description.h"
#include "harness/report/page.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::judge_replay_test {
namespace {

constexpr int kJoints = 7;
constexpr double kStep = 0.1;             // s
constexpr double kFloatTolerance = 1e-6;  // m: positions are 4-byte floats

RecordingJudgement Record(std::mt19937* random) {
  RecordingJudgement judgement;
  for (int row = 0; row < 20; ++row) {
    TorqueTrace& trace = judgement.traces.emplace_back();
    trace.time = kStep * row;
    trace.q =
        VectorXd::NullaryExpr(kJoints, [&] { return std::uniform_real_distribution<>(-1.0, 1.0)(*random); });
  }
  return judgement;
}

/// Reads the positions of the links at the kept instants.
std::vector<float> ReadPositions(const ReplayData& replay) {
  const auto parts = replay.json["parts"].get<size_t>() - 1;
  std::vector<float> all(3 * parts * replay.json["times"].size()), links;
  std::memcpy(all.data(), replay.values.data() + replay.json["positions"].get<size_t>(),
              sizeof(float) * all.size());
  for (size_t frame = 0; frame < replay.json["times"].size(); ++frame) {
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(3 * parts * frame);
    links.insert(links.end(), begin, begin + 3 * kJoints);
  }
  return links;
}

std::optional<ReplayData> Replay(const std::string& file, const RecordingJudgement& judgement) {
  const std::filesystem::path path = SourcePath(file);
  return MakeMotionReplay(RobotModel(ReadDescription(path).spec), path, judgement);
}

// The rows around a stretch that was held out have the time, too.
TEST(JudgeReplay, TimesIncrease) {
  std::mt19937 random(11);
  RecordingJudgement judgement = Record(&random);
  const auto all = Replay("/controller/parameters/panda.toml", judgement);
  judgement.traces[7].time = judgement.traces[6].time;
  const auto fewer = Replay("/controller/parameters/panda.toml", judgement);
  ASSERT_TRUE(all && fewer);
  EXPECT_EQ(fewer->json["times"].size(), all->json["times"].size() - 1);
}

TEST(JudgeReplay, RodsStandWhereTheEnginesLinksDo) {
  std::mt19937 random(11);
  const RecordingJudgement judgement = Record(&random), another = Record(&random);
  const auto rods = Replay("/controller/parameters/panda.toml", judgement);
  const auto meshes = Replay("/mjcf/panda.xml", judgement);
  ASSERT_TRUE(rods && meshes);
  EXPECT_EQ(rods->json["times"], meshes->json["times"]);
  const std::vector<float> a = ReadPositions(*rods), b = ReadPositions(*meshes);
  ASSERT_EQ(a.size(), b.size());
  ASSERT_EQ(a.size(), 3 * kJoints * judgement.traces.size());
  for (size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], kFloatTolerance) << i;
  // Another motion stands elsewhere.
  const std::vector<float> c = ReadPositions(*Replay("/mjcf/panda.xml", another));
  float largest = 0.0F;
  for (size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - c[i]));
  EXPECT_GT(largest, 0.1F);
}

TEST(JudgeReplay, WhatIsNotRecordedIsNotShown) {
  std::mt19937 random(12);
  RecordingJudgement judgement = Record(&random);
  EXPECT_FALSE(Replay("/controller/parameters/assistant_robot.toml", judgement)) << "its base moves";
  judgement.traces.resize(1);
  EXPECT_FALSE(Replay("/controller/parameters/panda.toml", judgement)) << "one instant";
  judgement.traces.clear();
  EXPECT_FALSE(Replay("/controller/parameters/panda.toml", judgement));
}

TEST(JudgeReplay, TimesOfAClockBeginAtZero) {
  RecordingJudgement judgement;
  for (const double t : {1.7e9, 1.7e9 + 1.0}) judgement.traces.emplace_back().time = t;
  EXPECT_EQ(FindTimeBegin(judgement, 0), 1.7e9);
  judgement.traces = {};
  for (const double t : {12.0, 13.0}) judgement.traces.emplace_back().time = t;
  EXPECT_EQ(FindTimeBegin(judgement, 0), 0.0);
  judgement.traces.back().recording = 1;
  EXPECT_EQ(FindTimeBegin(judgement, 0), 12.0) << "one of two";
  EXPECT_EQ(FindTimeBegin(judgement, 1), 13.0);
}

}  // namespace
}  // namespace dexcheck::testing::judge_replay_test
