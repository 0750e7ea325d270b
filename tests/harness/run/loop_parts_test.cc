// The loop computes the same on one thread and on two.

#include <gtest/gtest.h>

#include <utility>

#include "harness/run/runner.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::loop_parts_test {
namespace {

// Each check's value at each step, of tasks too, and how a run ends that fails.
TEST(TwoThreads, GiveTheSameBits) {
  for (const auto& [scenario, overrides] :
       {std::pair<const char*, std::vector<std::string>>{"curve", {"duration=0.2", "settle=0.3"}},
        {"lift", {"duration=0.6", "settle=0.1"}},
        {"paper-rigid", {"duration=0.1"}},
        {"hold",
         {"duration=0.2", "settle=0.3",
          "disturbance+={type='pulse', body='object', force=[0, 0, -300], begin=0.05, duration=0.1}"}}}) {
    SCOPED_TRACE(scenario);
    std::vector<double> values[2];
    std::string failures[2];
    for (const int threads : {1, 2}) {
      const ShippedRun shipped(scenario, overrides);
      LoopParts parts = MakeLoopParts(shipped.setup());
      parts.threads = threads;
      Runner runner(shipped.setup(), /*check=*/true, std::move(parts));
      std::vector<double>& all = values[threads - 1];
      failures[threads - 1] =
          runner
              .Run(
                  [&](const StepRecord& step) {
                    all.push_back(step.time);
                    all.insert(all.end(), step.reading.qpos.begin(), step.reading.qpos.end());
                    all.insert(all.end(), step.findings.xi_dot_model.begin(),
                               step.findings.xi_dot_model.end());
                    const RunChecks& checks = runner.loop().checks();
                    for (const auto records : {checks.model_checks(), checks.motion_checks()})
                      for (const CheckRecord& check : records) all.push_back(check.last);
                  },
                  [] { return false; })
              .failure;
    }
    EXPECT_GT(values[0].size(), 0U);
    EXPECT_EQ(values[0], values[1]);
    EXPECT_EQ(failures[0], failures[1]);
  }
}

TEST(TwoThreads, AreUsedWhereTheyAreFaster) {
  for (const double beside : {0.6, 3.0}) {  // of a step, where one thread takes 1
    ThreadChoice choice;
    double now = 1e5;
    long count = 0;
    constexpr long kSteps = 4 * ThreadChoice::kBlock * ThreadChoice::kBlocks;
    for (long i = 0; i < kSteps; ++i) {
      const bool is_beside = choice.Next(now);
      now += is_beside ? beside : 1.0;
      count += is_beside ? 1 : 0;
    }
    const double tried = 1.0 / static_cast<double>(ThreadChoice::kBlocks);
    EXPECT_DOUBLE_EQ(static_cast<double>(count) / kSteps, beside < 1.0 ? 1.0 - tried : tried);
  }
}

}  // namespace
}  // namespace dexcheck::testing::loop_parts_test
