// Jobs in processes of their own, whatever these do.

#include "harness/base/process_pool.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <map>
#include <set>
#include <stdexcept>

#include "controller/common/errors.h"
#include "tests/common/matchers.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::process_pool_test {
namespace {

std::map<long, EndedJob> RunAll(ProcessPool* pool, long count) {
  std::map<long, EndedJob> ended;
  for (long next = 0; next < count || !pool->IsEmpty();) {
    for (; next < count && !pool->IsFull(); ++next) pool->Start(next, std::to_string(next));
    if (auto job = pool->Wait()) ended[job->number] = *job;
  }
  return ended;
}

TEST(ByteArchive, ValuesComeBackWhole) {
  const std::vector<std::vector<double>> lists = {{0.1, -1e300}, {}};
  const std::string bytes = PackBytes(7L, std::string("a\0b", 3), lists, true);
  long number = 0;
  std::string text;
  std::vector<std::vector<double>> back;
  bool flag = false;
  UnpackBytes(bytes, &number, &text, &back, &flag);
  EXPECT_EQ(number, 7);
  EXPECT_EQ(text, std::string("a\0b", 3));
  EXPECT_EQ(back, lists);
  EXPECT_TRUE(flag);
  for (size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THROW(UnpackBytes(bytes.substr(0, size), &number, &text, &back, &flag), Error) << size;
}

TEST(ProcessPool, ResultsComeBackWhole) {
  const std::string large(200000, 'x');  // more than a channel takes at once
  ProcessPool pool("it", 3, 0.0, [&](const std::string& request) { return request + large; });
  const auto ended = RunAll(&pool, 10);
  ASSERT_EQ(ended.size(), 10U);
  for (const auto& [number, job] : ended) EXPECT_EQ(job.result, std::to_string(number) + large);
}

TEST(ProcessPool, ACrashCostsNoOtherJob) {
  ProcessPool pool("it", 2, 0.0, [](const std::string& request) {
    if (request == "1") {
      std::signal(SIGSEGV, SIG_DFL);  // sanitizers have a handler of their own
      std::raise(SIGSEGV);
    }
    if (request == "2") throw std::runtime_error("thrown");
    if (request == "3") ::_exit(0);
    return request;
  });
  const auto ended = RunAll(&pool, 6);
  ASSERT_EQ(ended.size(), 6U);
  for (const long good : {0L, 4L, 5L}) EXPECT_EQ(ended.at(good).result, std::to_string(good));
  for (const long bad : {1L, 2L, 3L}) EXPECT_FALSE(ended.at(bad).result) << bad;
  EXPECT_THAT(ended.at(1).failure, HasSubstr("Segmentation fault"));
  EXPECT_EQ(ended.at(2).failure, "thrown");
  EXPECT_EQ(ended.at(3).failure, "the process ended without a result");
}

// A process does one job after another; who did them does not show.
TEST(ProcessPool, AProcessDoesManyJobsAndACrashBringsANewOne) {
  ProcessPool pool("it", 2, 0.0, [](const std::string& request) {
    if (request == "9") ::_exit(1);
    return std::to_string(::getpid());
  });
  std::set<std::string> processes;
  for (const auto& [number, job] : RunAll(&pool, 40)) {
    EXPECT_EQ(job.result.has_value(), number != 9);
    if (job.result) processes.insert(*job.result);
  }
  EXPECT_LE(processes.size(), 3U) << "two, and one in the place of the one that ended";
}

// A message of an earlier job is not taken for that of a later one.
TEST(ProcessPool, MessagesBelongToTheirJob) {
  ProcessPool pool("it", 1, 0.0, [](const std::string& request) {
    if (request == "0") std::fprintf(stderr, "a warning that is long ago\n");
    if (request == "1") std::raise(SIGKILL);
    return request;
  });
  EXPECT_THAT(RunAll(&pool, 2).at(1).failure, Not(HasSubstr("long ago")));
}

TEST(ProcessPool, ReportsWhatWasKilledFromOutside) {
  for (const int signal : {SIGKILL, SIGTERM, SIGHUP, SIGABRT}) {
    ProcessPool pool("it", 1, 0.0, [&](const std::string& request) {
      std::signal(signal, SIG_DFL);
      std::raise(signal);
      return request;
    });
    EXPECT_EQ(RunAll(&pool, 1).at(0).killed_from_outside, signal != SIGABRT) << signal;
    EXPECT_TRUE(pool.IsEmpty());
  }
}

TEST(ProcessPool, EndsJobsThatTakeTooLong) {
  constexpr double kLimit = 0.2;  // s of processor time
  ProcessPool pool("it", 2, kLimit, [](const std::string& request) {
    volatile double sum = 0.0;
    while (request == "1") sum = sum + 1.0;
    // Waiting costs no processor time.
    if (request == "2") ::usleep(500'000);
    return request;
  });
  for (const auto& [number, job] : RunAll(&pool, 4)) EXPECT_EQ(job.timed_out, number == 1) << number;
}

TEST(RunJobs, TakesResultsInOrderUntilItIsInterrupted) {
  std::vector<size_t> taken;
  const auto run = [](size_t job) {
    ::usleep(job % 3 == 0 ? 30'000 : 0);
    return PackBytes(job * job);
  };
  const auto take = [&](size_t job, const std::string& result) {
    size_t square = 0;
    UnpackBytes(result, &square);
    EXPECT_EQ(square, job * job);
    taken.push_back(job);
  };
  EXPECT_EQ(RunJobs("it", 12, 3, run, take, [] { return false; }), 12U);
  EXPECT_EQ(taken, (std::vector<size_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
  taken.clear();
  EXPECT_EQ(RunJobs("it", 12, 3, run, take, [&] { return taken.size() >= 4; }), taken.size());
  EXPECT_GE(taken.size(), 4U);
  EXPECT_TRUE(Throws<Error>(
      [&] {
        const auto fail = [](size_t) -> std::string { throw std::runtime_error("no such thing"); };
        return RunJobs("it", 2, 1, fail, take, [] { return false; });
      },
      "it: no such thing"));
  EXPECT_TRUE(Throws<InputError>(
      [&] {
        const auto refuse = [](size_t) -> std::string { throw InputError("a.h5: time: is odd"); };
        return RunJobs("it", 2, 1, refuse, take, [] { return false; });
      },
      "a.h5: time: is odd"));
}

}  // namespace
}  // namespace dexcheck::testing::process_pool_test
