// Motions that excite: what is found shows more than what was given, within the limits, and is what is
// printed.

#include "harness/study/exciting_motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "tests/common/matchers.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::exciting_motion_test {
namespace {

const std::string kPanda = SourcePath("/controller/parameters/panda.toml");
const std::string kScene = SourcePath("/mjcf/panda_scene.xml");

/// The Panda, two of whose joints swing.
Scenario MakeSwing() {
  return ReadShippedScenario(
      "panda-reach", {"duration=0.6", "settle=0.1", "joint_motion.points=[]",
                      "joint_motion.oscillations=[{ joint = 'panda_joint2', amplitude_deg = 2, frequency = "
                      "0.5, ramp_time = 0.2 "
                      "}, { joint = 'panda_joint4', amplitude_deg = 2, frequency = 0.5, ramp_time = 0.2 }]"});
}

TEST(ExcitingMotion, FindsOneThatShowsMore) {
  const Scenario scenario = MakeSwing();
  ExcitingMotionOptions options;
  options.runs = 12;
  const ExcitingMotion motion =
      FindExcitingMotion(scenario, kPanda, kScene, options, [](int) { return true; });
  ASSERT_EQ(motion.keys.size(), 4U);
  EXPECT_LE(motion.runs, 12);
  EXPECT_GT(motion.rank, 3);
  EXPECT_GT(motion.given.smallest, motion.floor);
  EXPECT_GT(motion.found.smallest, 1.1 * motion.given.smallest);
  EXPECT_LE(motion.found.excess, 0.0);
  EXPECT_FALSE(motion.overrides.empty());
  for (size_t k = 0; k < motion.keys.size(); ++k) {
    EXPECT_GE(motion.found.values[k], 0.99 * motion.keys[k].from);
    EXPECT_LE(motion.found.values[k], 1.01 * motion.keys[k].to);
  }
}

TEST(ExcitingMotion, StopsAtOnce) {
  const ExcitingMotion motion =
      FindExcitingMotion(MakeSwing(), kPanda, kScene, {}, [](int) { return false; });
  EXPECT_EQ(motion.runs, 1);
  EXPECT_TRUE(motion.overrides.empty());
  EXPECT_EQ(motion.found.smallest, motion.given.smallest);
}

TEST(ExcitingMotion, ListsTheNumbersOfATrajectory) {
  std::vector<std::string> keys;
  for (const MotionKey& key : ListMotionKeys(ReadShippedScenario("reorient"))) keys.push_back(key.key);
  EXPECT_THAT(keys, ElementsAre(HasSubstr("trajectory."), HasSubstr("trajectory.frequency")));
  EXPECT_EQ(ListMotionKeys(ReadShippedScenario("exercise")).size(), 15U);
}

TEST(ExcitingMotion, RefusesWhatDoesNotOscillate) {
  try {
    FindExcitingMotion(ReadShippedScenario("hold"), kPanda, kScene, {}, [](int) { return true; });
    ADD_FAILURE() << "is accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("must have a trajectory, or a motion of joints, that oscillates"));
  }
}

}  // namespace
}  // namespace dexcheck::testing::exciting_motion_test
