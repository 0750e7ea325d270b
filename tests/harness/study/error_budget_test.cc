// Budgets: every source is found, parts add up where they do not interact, and the prediction is right where
// it must be.

#include "harness/study/error_budget.h"

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "tests/common/throws.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::error_budget_test {
namespace {

constexpr int kJobs = 2;

ErrorBudget Calc(const std::string& scenario, const std::vector<std::string>& overrides) {
  const bool is_panda = scenario.starts_with("panda");
  return CalcErrorBudget(
      ReadShippedScenario(scenario, overrides),
      SourcePath("/controller/parameters/") + (is_panda ? "panda.toml" : "assistant_robot.toml"),
      SourcePath("/mjcf/") + (is_panda ? "panda_scene.xml" : "scene.xml"), kJobs,
      [](long, long) { return true; });
}

/// Sources that are as large as this at least, do not interact, add up and are predicted.
void ExpectSumsAndPredictions(const ErrorBudget& budget, size_t sources, double least) {
  EXPECT_TRUE(budget.is_complete()) << budget.failure;
  ASSERT_EQ(budget.entries.size(), sources);
  for (const BudgetEntry& entry : budget.entries) {
    SCOPED_TRACE(entry.name);
    EXPECT_GT(entry.alone.rms, least);
    EXPECT_FALSE(entry.interacts()) << entry.interaction;
    EXPECT_NEAR(entry.predicted.rms, entry.alone.rms, 0.1 * entry.alone.rms);
  }
  EXPECT_NEAR(budget.sum.rms, budget.all.rms, 0.1 * budget.all.rms);
}

TEST(ErrorBudget, PartsThatDoNotInteractAddUpAndArePredicted) {
  const ErrorBudget budget =
      Calc("curve", {"duration=0.6", "settle=0.5", "mismatch.mass={ r_forearm = 1.01 }",
                     "actuation.gain_error={ r_elbow = 2e-3 }",
                     "disturbance=[{ type = 'step', body = 'object', force = [0, 0.05, 0], begin = 0.1 }]"});
  ExpectSumsAndPredictions(budget, 3, 10.0 * budget.ideal.rms);
}

// Also of an arm that holds nothing, whatever its law: by computed torque, and by springs.
TEST(ErrorBudget, PartsOfAMotionOfJointsAddUpAndArePredicted) {
  for (const std::string law : {"computed_torque", "feedforward_pd"}) {
    SCOPED_TRACE(law);
    const ErrorBudget budget = Calc(
        "panda-reach",
        {"duration=0.8", "settle=0.2", "control.law='" + law + "'", "mismatch.mass={ panda_link4 = 1.02 }",
         "actuation.gain_error={ panda_joint2 = 2e-3 }", "sensing.latency=0.001",
         "disturbance=[{ type = 'step', body = 'panda_link5', force = [0, 2, 0], begin = 0.2 }]"});
    ExpectSumsAndPredictions(budget, 4, 1e-7);
    EXPECT_TRUE(budget.of_joints);
    EXPECT_EQ(ToJson(budget).at("unit"), "rad");
    EXPECT_EQ(ToJson(budget).at("all").at("rms"), budget.all.rms);
  }
}

// A run begins with no lasting error of what noise its first step has.
TEST(ErrorBudget, NoiseIsPredictedToItsSize) {
  constexpr double kFewPeriods = 0.3;  // what the rms of a second of filtered noise is known to
  const ErrorBudget budget = Calc("panda-reach", {"duration=1", "settle=0.2", "sensing.joint_noise=1e-5"});
  ASSERT_EQ(budget.entries.size(), 1U);
  const BudgetEntry& entry = budget.entries[0];
  EXPECT_GT(entry.alone.rms, 10.0 * budget.ideal.rms);
  EXPECT_NEAR(entry.predicted.rms, entry.alone.rms, kFewPeriods * entry.alone.rms);
}

// At rest, motors that give 1 + g of what they are sent bear what weighs 1 + m of what is known with an error
// of (1 + m) / (1 + g) - 1 of the weight: that is more than m and 1 / (1 + g) - 1 by their product.
TEST(ErrorBudget, SourcesThatInteractAreMarked) {
  constexpr double kMass = 0.5, kGain = -0.3;
  const ErrorBudget budget =
      Calc("panda-reach", {"duration=0.5", "settle=0.5", "actuation.gain_error=-0.3", "mismatch.mass=1.5"});
  EXPECT_TRUE(budget.is_complete()) << budget.failure;
  const double of_gain = 1.0 / (1.0 + kGain) - 1.0;
  const double expected = kMass * of_gain / ((1.0 + kMass) / (1.0 + kGain) - 1.0);
  ASSERT_EQ(budget.entries.size(), 2U);
  for (const BudgetEntry& entry : budget.entries) {
    EXPECT_TRUE(entry.interacts()) << entry.name << " " << entry.interaction;
    EXPECT_NEAR(entry.interaction, expected, 0.2 * expected) << entry.name;
  }
  EXPECT_GT(budget.all.rms, 1.1 * budget.sum.rms);
}

TEST(ErrorBudget, EverySourceOfAScenarioIsListedAndDropped) {
  const Scenario scenario = ReadShippedScenario(
      "curve",
      {"sensing={ joint_counts = 4096, joint_noise = 1e-5, velocity = 'kalman', kalman_acceleration = 10, "
       "velocity_noise = 1e-3, odometry = true, object_position_noise = 1e-4, object_orientation_noise = "
       "1e-4, object_rate = 100, object_latency = 0.01, object_velocity = 'differenced', latency = 0.002 }",
       "actuation={ delay = 0.001, torque_step = 0.01, gain_error = 0.01, lag = 0.001, backlash = 1e-4, "
       "coulomb = 0.1 }",
       "disturbance=[{ type = 'slope', slope_deg = [1, 0] }, { type = 'step', body = 'object' }, { type = "
       "'payload', body = 'r_palm', mass = 0.1 }]",
       "mismatch={ mass = 1.1, mass_within = 0.1, com = { r_palm = [0.01, 0, 0] }, damping = 1.1, armature = "
       "1.1 }"});
  Imperfections left = scenario.imperfections;
  const std::vector<ErrorSource> sources = ListErrorSources(left);
  EXPECT_EQ(sources.size(), 11U + 6U + 1U + 7U);
  for (const ErrorSource& source : sources) {
    EXPECT_FALSE(left.is_ideal()) << source.name;
    source.drop(&left);
    EXPECT_EQ(ListErrorSources(left).size(),
              sources.size() - 1U - static_cast<size_t>(&source - sources.data()))
        << source.name;
  }
  EXPECT_TRUE(left.is_ideal());
}

TEST(ErrorBudget, IdealPlantsAndTasksAreRefused) {
  EXPECT_TRUE(Throws<InputError>([] { return Calc("curve", {"duration=0.1"}); }, "has nothing in [sensing]"));
  EXPECT_TRUE(Throws<InputError>([] { return Calc("lift", {"mismatch.mass=1.01"}); },
                                 "task: a budget needs a trajectory"));
}

}  // namespace
}  // namespace dexcheck::testing::error_budget_test
