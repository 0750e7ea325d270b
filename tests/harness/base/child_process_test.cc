// Work in another process: what it reports arrives, and however it ends, this process goes on and knows how.

#include "harness/base/child_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <vector>

namespace dexcheck::testing::child_process_test {
namespace {

TEST(ChildProcess, RunsPrograms) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const auto run = [&](const std::vector<std::string>& words) {
    return ChildProcess("it", Program{.words = words, .output = ends[1], .folder = "/"}).Wait();
  };
  EXPECT_TRUE(run({"sh", "-c", "pwd"}).has_succeeded());
  char text[10] = {};
  EXPECT_EQ(::read(ends[0], text, sizeof text), 2);
  EXPECT_STREQ(text, "/\n");
  EXPECT_EQ(run({"sh", "-c", "exit 4"}).Describe(), "ended with exit code 4");
  EXPECT_EQ(run({"sh", "-c", "kill -9 $$"}).Describe(), "was killed by signal 9");
  EXPECT_EQ(run({"no_such_program_of_anybody"}).exit_code, kNotFoundExitCode);
  // With all that it has started, and what is known of its end is reported once.
  {
    ChildProcess process("it", Program{.words = {"sh", "-c", "sleep 60 & wait"}, .output = ends[1]});
    EXPECT_FALSE(process.WaitFor(0.0).has_value());
  }
  ::close(ends[1]);
  EXPECT_EQ(::read(ends[0], text, sizeof text), 0) << "nobody holds the pipe";
  ::close(ends[0]);
  ChildProcess process("it", Program{.words = {"true"}});
  EXPECT_TRUE(process.WaitFor(60.0)->has_succeeded());
  EXPECT_FALSE(process.WaitFor(60.0).has_value());
}

TEST(ChildProcess, EndsWithItsOwner) {
  const auto sleep = [](int) {
    ::pause();
    return true;
  };
  pid_t first = -1;
  pid_t second = -1;
  {
    std::vector<ChildProcess> processes;
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

TEST(ChildProcess, OneThatHasEndedIsToldNothing) {
  ChildProcess process("it", [](int) { return true; });
  EXPECT_EQ(Receive(process.channel(), 1), "");
  EXPECT_FALSE(Send(process.channel(), std::string(1 << 20, 'x')));
}

}  // namespace
}  // namespace dexcheck::testing::child_process_test
