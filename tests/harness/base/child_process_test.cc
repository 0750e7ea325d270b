// Work in another process: what it tells arrives, and however it ends, this process goes on and knows how.

#include "harness/base/worker_process.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <stdexcept>
#include <vector>

namespace dexcheck::worker_process_test {
namespace {

std::string ReceiveAll(int channel) {
  std::string all;
  for (std::string part = Receive(channel, 1000); !part.empty(); part = Receive(channel, 1000)) all += part;
  return all;
}

TEST(WorkerProcess, TellsAndIsTold) {
  const std::string large(1 << 20, 'x');
  WorkerProcess process("it", [&](int channel) { return Send(channel, Receive(channel, 4) + large); });
  EXPECT_TRUE(Send(process.channel(), "word"));
  EXPECT_EQ(ReceiveAll(process.channel()), "word" + large);
  const ProcessEnd end = process.Wait();
  EXPECT_TRUE(end.succeeded);
  EXPECT_EQ(end.signal, 0);
  EXPECT_EQ(process.pid(), -1);
}

TEST(WorkerProcess, EndsInManyWays) {
  const auto end_of = [](const std::function<bool(int)>& work) {
    WorkerProcess process("it", work);
    EXPECT_EQ(ReceiveAll(process.channel()), "");
    return process.Wait();
  };
  EXPECT_FALSE(end_of([](int) { return false; }).succeeded);
  EXPECT_FALSE(end_of([](int) -> bool { throw std::runtime_error("no"); }).succeeded);
  const ProcessEnd crash = end_of([](int) {
    std::signal(SIGSEGV, SIG_DFL);
    return ::raise(SIGSEGV) == 0;
  });
  EXPECT_FALSE(crash.succeeded);
  EXPECT_EQ(crash.signal, SIGSEGV);
  EXPECT_EQ(crash.Describe("by itself"), "Segmentation fault");
  EXPECT_EQ(end_of([](int) { return false; }).Describe("by itself"), "by itself");
}

TEST(WorkerProcess, EndsWithItsOwner) {
  const auto sleep = [](int) {
    ::pause();
    return true;
  };
  pid_t first = -1;
  pid_t second = -1;
  {
    std::vector<WorkerProcess> processes;
    processes.emplace_back("it", sleep);
    processes.emplace_back("it", sleep);
    first = processes[0].pid();
    second = processes[1].pid();
    processes.erase(processes.begin());
    EXPECT_EQ(::kill(first, 0), -1);
    EXPECT_EQ(errno, ESRCH);
    EXPECT_EQ(processes[0].pid(), second);
    EXPECT_EQ(::kill(second, 0), 0);
  }
  EXPECT_EQ(::kill(second, 0), -1);
}

TEST(WorkerProcess, OneThatHasEndedIsToldNothing) {
  WorkerProcess process("it", [](int) { return true; });
  EXPECT_EQ(Receive(process.channel(), 1), "");
  EXPECT_FALSE(Send(process.channel(), std::string(1 << 20, 'x')));
}

}  // namespace
}  // namespace dexcheck::worker_process_test
