#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "controller/common/errors.h"
#include "harness/engine/engine.h"
#include "renders/viewpoint.h"
#include "tests/common/paths.h"
#include "tests/common/throws.h"
#include "tests/renders/kinematic_run.h"

namespace dexcheck::testing::run_frames_test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class RunFramesTest : public ::testing::Test {
 protected:
  MjModelPtr model_ = LoadMjcf(SourcePath("/mjcf/scene.xml"));
  RunFrames run_ = MakeKinematicRun(*model_, 0.1);
};

TEST_F(RunFramesTest, AcceptsARunWithAndWithoutExtras) {
  EXPECT_NO_THROW(CheckRunFrames(*model_, run_));
  RunFrames bare;
  bare.source = "bare";
  bare.times = run_.times;
  bare.qpos = run_.qpos;
  EXPECT_NO_THROW(CheckRunFrames(*model_, bare));
}

TEST_F(RunFramesTest, RefusesWhatDoesNotFitInOneLine) {
  const auto expect = [&](const std::function<void(RunFrames*)>& spoil, const std::string& message) {
    RunFrames run = run_;
    spoil(&run);
    EXPECT_TRUE(Throws<InputError>([&] { CheckRunFrames(*model_, run); }, "kinematic run: " + message));
  };
  expect([](RunFrames* run) { run->times.clear(); }, "time: the run has no recorded instants");
  expect(
      [](RunFrames* run) {
        run->times.resize(1);
        run->qpos = run->qpos.topRows(1).eval();
      },
      "time: the run ends where it begins, at 0 s");
  expect([](RunFrames* run) { run->times[4] = run->times[3]; }, "time: must increase, got 0.03 in row 4");
  expect([](RunFrames* run) { run->times[4] = kNan; }, "time: row 4 is not finite");
  expect([](RunFrames* run) { run->qpos = run->qpos.leftCols(63).eval(); },
         "qpos: must be 11 x 64, got 11 x 63");
  expect([](RunFrames* run) { run->qpos(3, 5) = kNan; }, "qpos: is not finite");
  expect([](RunFrames* run) { run->position_errors.pop_back(); },
         "position error: must be 11 x 1, got 10 x 1");
  expect([](RunFrames* run) { run->checks[1].residuals.clear(); },
         "check acceleration: must be 11 x 1, got 0 x 1");
  expect([](RunFrames* run) { run->contact_forces = run->contact_forces.leftCols(9).eval(); },
         "contact forces: must be 11 x 12, got 11 x 9");
  expect([](RunFrames* run) { run->desired_positions = run->desired_positions.topRows(2).eval(); },
         "desired positions: must be 11 x 3, got 2 x 3");
}

TEST_F(RunFramesTest, RowAtIsTheLastOneRecorded) {
  EXPECT_EQ(run_.RowAt(-1.0), 0);
  EXPECT_EQ(run_.RowAt(0.0), 0);
  EXPECT_EQ(run_.RowAt(0.0199), 1);
  EXPECT_EQ(run_.RowAt(99.0), 10);
}

TEST_F(RunFramesTest, CheckHistoryKeepsTheWorstPerBound) {
  run_.checks = {{"a", CheckCategory::kModel, 1e-3, std::vector<double>(11, 5e-4)},
                 {"b", CheckCategory::kModel, 1e-9, std::vector<double>(11, 1e-10)},
                 {"c", CheckCategory::kInverseDynamics, 1.0, std::vector<double>(11, 0.0)}};
  run_.checks[1].residuals[4] = -8e-10;
  run_.checks[2].residuals[6] = kNan;
  const CheckHistory history(run_);
  const auto at = [&](size_t category, long row) { return history.ListCategories(row)[category]; };
  EXPECT_EQ(at(0, 3).nearest.name, "a");
  EXPECT_DOUBLE_EQ(at(0, 3).nearest.worst, 5e-4);
  EXPECT_EQ(at(0, 4).nearest.name, "b");
  EXPECT_DOUBLE_EQ(at(0, 10).nearest.worst, 8e-10) << "a peak stays";
  EXPECT_EQ(at(2, 5).nearest.worst, 0.0);
  EXPECT_EQ(at(2, 10).nearest.worst, std::numeric_limits<double>::infinity());
  EXPECT_FALSE(at(3, 10).is_asked());
  ASSERT_EQ(history.ListCategories(0).size(), kCheckCategories.size());
  for (size_t i = 0; i < kCheckCategories.size(); ++i) EXPECT_EQ(at(i, 0).category, kCheckCategories[i]);
  run_.checks.clear();
  EXPECT_TRUE(CheckHistory(run_).ListCategories(3).empty());
}

}  // namespace
}  // namespace dexcheck::testing::run_frames_test
