// Trials in processes of their own, whatever these do.

#include "harness/study/trial_pool.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <stdexcept>

#include "harness/engine/engine.h"

namespace dexcheck::testing::trial_pool_test {
namespace {

TrialResult MakeResult(const Trial& trial) {
  TrialResult result;
  result.metrics.fill(0.5);
  result.metrics[kEnergy] = trial.parameters[0];
  return result;
}

std::map<long, TrialResult> RunAll(TrialPool* pool, long count) {
  std::map<long, TrialResult> results;
  long next = 0;
  while (next < count || !pool->IsEmpty()) {
    while (next < count && !pool->IsFull()) {
      pool->Start({next, 0, {0.1 * static_cast<double>(next)}});
      ++next;
    }
    if (const auto ended = pool->Wait()) results[ended->row.trial.number] = ended->row.result;
  }
  return results;
}

TEST(TrialPool, ResultsComeBackWhole) {
  const std::string failure(20000, 'x');  // more than a pipe takes at once
  TrialPool pool(3, 0.0, [&](const Trial& trial) {
    TrialResult result = MakeResult(trial);
    result.outcome = Outcome::kWheelsSpun;
    result.failure = failure;
    return result;
  });
  const auto results = RunAll(&pool, 10);
  ASSERT_EQ(results.size(), 10u);
  for (const auto& [trial, result] : results) {
    EXPECT_EQ(result.outcome, Outcome::kWheelsSpun);
    EXPECT_EQ(result.metrics[kEnergy], 0.1 * static_cast<double>(trial));
    EXPECT_EQ(result.failure, failure);
  }
}

TEST(TrialPool, ACrashCostsNoOtherTrial) {
  const MjModelPtr engine = LoadMjcfText("<mujoco/>", "empty.xml");  // the handlers of engine errors
  TrialPool pool(2, 0.0, [](const Trial& trial) {
    if (trial.number == 1) {
      std::signal(SIGSEGV, SIG_DFL);  // sanitizers have a handler of their own
      std::raise(SIGSEGV);
    }
    if (trial.number == 2) mju_error("no such thing");
    if (trial.number == 3) throw std::runtime_error("thrown");
    if (trial.number == 4) ::_exit(0);
    return MakeResult(trial);
  });
  const auto results = RunAll(&pool, 6);
  ASSERT_EQ(results.size(), 6u);
  for (const long good : {0L, 5L}) EXPECT_EQ(results.at(good).outcome, Outcome::kTracked);
  for (const long bad : {1L, 2L, 3L, 4L}) EXPECT_EQ(results.at(bad).outcome, Outcome::kCrashed) << bad;
  EXPECT_NE(results.at(1).failure.find("Segmentation fault"), std::string::npos) << results.at(1).failure;
  EXPECT_NE(results.at(2).failure.find("no such thing"), std::string::npos) << results.at(2).failure;
  EXPECT_NE(results.at(3).failure.find("thrown"), std::string::npos) << results.at(3).failure;
}

// A process makes one trial after another; who made them does not show.
TEST(TrialPool, AProcessMakesManyTrialsAndACrashBringsANewOne) {
  TrialPool pool(2, 0.0, [](const Trial& trial) {
    if (trial.number == 9) ::_exit(1);
    TrialResult result = MakeResult(trial);
    result.metrics[kPeakTorque] = static_cast<double>(::getpid());
    return result;
  });
  const auto results = RunAll(&pool, 40);
  ASSERT_EQ(results.size(), 40U);
  std::map<double, int> by_process;
  for (const auto& [trial, result] : results) {
    if (trial == 9) {
      EXPECT_EQ(result.outcome, Outcome::kCrashed);
      continue;
    }
    EXPECT_EQ(result.metrics[kEnergy], 0.1 * static_cast<double>(trial));
    ++by_process[result.metrics[kPeakTorque]];
  }
  EXPECT_LE(by_process.size(), 3U) << "two, and one in the place of the one that ended";
}

// A message of an earlier trial is not taken for that of a later one.
TEST(TrialPool, MessagesBelongToTheirTrial) {
  TrialPool pool(1, 0.0, [](const Trial& trial) {
    if (trial.number == 0) std::fprintf(stderr, "a warning that is long ago\n");
    if (trial.number == 1) std::raise(SIGKILL);
    return MakeResult(trial);
  });
  const auto results = RunAll(&pool, 2);
  EXPECT_EQ(results.at(1).outcome, Outcome::kCrashed);
  EXPECT_EQ(results.at(1).failure.find("long ago"), std::string::npos) << results.at(1).failure;
}

TEST(TrialPool, TellsWhatWasKilledFromOutside) {
  for (const int signal : {SIGKILL, SIGTERM, SIGHUP, SIGABRT}) {
    TrialPool pool(1, 0.0, [&](const Trial& trial) {
      std::signal(signal, SIG_DFL);
      std::raise(signal);
      return MakeResult(trial);
    });
    pool.Start({0, 0, {0.0}});
    std::optional<EndedTrial> ended;
    while (!ended) ended = pool.Wait();
    EXPECT_EQ(ended->killed_from_outside, signal != SIGABRT) << signal;
    EXPECT_EQ(ended->row.result.outcome, Outcome::kCrashed);
    EXPECT_TRUE(pool.IsEmpty());
  }
}

TEST(TrialPool, EndsTrialsThatTakeTooLong) {
  constexpr double kLimit = 0.2;  // s of processor time
  TrialPool pool(2, kLimit, [](const Trial& trial) {
    volatile double sum = 0.0;
    while (trial.number == 1) sum = sum + 1.0;
    // Waiting costs no processor time.
    if (trial.number == 2) ::usleep(500'000);
    return MakeResult(trial);
  });
  const auto results = RunAll(&pool, 4);
  ASSERT_EQ(results.size(), 4u);
  EXPECT_EQ(results.at(1).outcome, Outcome::kTimedOut);
  EXPECT_EQ(results.at(1).failure, "it took more than trial_time_limit, 0.2 s of processor time");
  for (const long good : {0L, 2L, 3L}) EXPECT_EQ(results.at(good).outcome, Outcome::kTracked) << good;
}

}  // namespace
}  // namespace dexcheck::testing::trial_pool_test
