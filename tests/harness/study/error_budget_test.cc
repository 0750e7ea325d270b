// Budgets: every source is found, parts add up where they do not interact, and the prediction is right where
// it must be.

#include "harness/study/error_budget.h"

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "tests/common/throws.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::error_budget_test {
namespace {

const std::string kRobot = SourcePath("/controller/parameters/assistant_robot.toml");
const std::string kScene = SourcePath("/mjcf/scene.xml");

ErrorBudget Calc(const std::vector<std::string>& overrides) {
  return CalcErrorBudget(ReadShippedScenario("curve", overrides), kRobot, kScene,
                         [](long, long) { return true; });
}

TEST(ErrorBudget, PartsThatDoNotInteractAddUpAndArePredicted) {
  const ErrorBudget budget =
      Calc({"duration=0.6", "settle=0.5", "mismatch.mass={ r_forearm = 1.01 }",
            "actuation.gain_error={ r_elbow = 2e-3 }",
            "disturbance=[{ type = 'step', body = 'object', force = [0, 0.05, 0], begin = 0.1 }]"});
  EXPECT_TRUE(budget.is_complete()) << budget.failure;
  ASSERT_EQ(budget.entries.size(), 3U);
  for (const BudgetEntry& entry : budget.entries) {
    SCOPED_TRACE(entry.name);
    EXPECT_GT(entry.alone.rms, 10.0 * budget.ideal.rms);
    EXPECT_FALSE(entry.interacts()) << entry.interaction;
    EXPECT_NEAR(entry.predicted.rms, entry.alone.rms, 0.1 * entry.alone.rms);
  }
  EXPECT_NEAR(budget.sum.rms, budget.all.rms, 0.1 * budget.all.rms);
}

TEST(ErrorBudget, EverySourceOfAScenarioIsListedAndDropped) {
  const Scenario scenario = ReadShippedScenario(
      "curve",
      {"sensing={ joint_counts = 4096, joint_noise = 1e-5, velocity = 'kalman', kalman_acceleration = 10, "
       "velocity_noise = 1e-3, odometry = true, object_position_noise = 1e-4, object_orientation_noise = "
       "1e-4, "
       "object_rate = 100, object_latency = 0.01, object_velocity = 'differenced', latency = 0.002 }",
       "actuation={ delay = 0.001, torque_step = 0.01, gain_error = 0.01, lag = 0.001, backlash = 1e-4, "
       "coulomb = 0.1 }",
       "disturbance=[{ type = 'slope', slope_deg = [1, 0] }, { type = 'step', body = 'object' }, "
       "{ type = 'payload', body = 'r_palm', mass = 0.1 }]",
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
  EXPECT_TRUE(Throws<InputError>([] { return Calc({"duration=0.1"}); }, "asks for nothing of [sensing]"));
}

}  // namespace
}  // namespace dexcheck::testing::error_budget_test
