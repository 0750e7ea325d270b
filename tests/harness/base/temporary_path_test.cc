// A signal removes whatever is under construction, and nothing else.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "tests/common/files.h"

namespace dexcheck::testing::temporary_path_test {
namespace {

namespace fs = std::filesystem;

constexpr int kExitCode = 3;

/// Runs `work` in a process of its own, with signals handled. @return how it ended, as waitpid says.
int RunForked(const std::function<void()>& work) {
  const pid_t process = ::fork();
  if (process == 0) {
    for (const int signal : {SIGHUP, SIGPIPE}) std::signal(signal, SIG_DFL);  // nohup's are ignored
    HandleSignals(kExitCode);
    work();
    ::_exit(EXIT_SUCCESS);
  }
  int status = -1;
  EXPECT_EQ(::waitpid(process, &status, 0), process);
  return status;
}

bool HasExited(int status, int code) { return WIFEXITED(status) && WEXITSTATUS(status) == code; }

class TemporaryPathTest : public ::testing::Test {
 protected:
  TempFolder folder_;
  fs::path kept_ = folder_.path() / "kept";

  /// Begins files and folders of all kinds, then sends the signal to itself.
  void BeginAndRaise(int signal) const {
    WriteText(kept_, "kept");
    const PartialFile partial(folder_.path() / "page.html");
    WriteText(partial.partial(), "half");
    const fs::path made = folder_.path() / "figures";
    fs::create_directories(made / "a/b/c");
    const TemporaryPath protection(made);
    for (int k = 0; k < 300; ++k) WriteText(made / "a/b" / std::to_string(k), "x");
    fs::create_symlink(kept_, made / "a/link");
    fs::create_symlink(folder_.path(), made / "link to a folder");
    std::raise(signal);
  }
  [[nodiscard]] bool IsOnlyKeptLeft() const {
    const auto count = std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator());
    return count == 1 && ReadText(kept_) == "kept";
  }
};

TEST_F(TemporaryPathTest, SignalsRemoveWhatIsUnderConstruction) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    EXPECT_TRUE(HasExited(RunForked([&] { BeginAndRaise(signal); }), kExitCode)) << ::strsignal(signal);
    EXPECT_TRUE(IsOnlyKeptLeft());
  }
  const int status = RunForked([&] { BeginAndRaise(SIGPIPE); });
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGPIPE) << "dies as without a handler";
  EXPECT_TRUE(IsOnlyKeptLeft());
}

TEST_F(TemporaryPathTest, ACaughtSignalEndsOnlyTheSecondTime) {
  EXPECT_TRUE(HasExited(RunForked([&] {
                          CatchInterrupts();
                          std::raise(SIGINT);
                          if (!IsInterrupted()) ::_exit(10);
                          BeginAndRaise(SIGINT);
                          ::_exit(11);
                        }),
                        kExitCode));
  EXPECT_TRUE(IsOnlyKeptLeft());
  EXPECT_TRUE(HasExited(RunForked([&] {
                          CatchInterrupts();
                          EndOnInterrupts(1);
                          BeginAndRaise(SIGINT);
                          ::_exit(11);
                        }),
                        1));
  EXPECT_TRUE(IsOnlyKeptLeft());
}

TEST_F(TemporaryPathTest, ASignalThatIsHeldComesLater) {
  const fs::path made = folder_.path() / "made";
  EXPECT_TRUE(HasExited(RunForked([&] {
                          std::optional<TemporaryPath> protection;
                          {
                            const HeldSignals held;
                            fs::create_directory(made);
                            std::raise(SIGTERM);
                            protection.emplace(made);
                          }
                          ::_exit(11);
                        }),
                        kExitCode));
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(TemporaryPathTest, WhatIsFinishedStays) {
  const fs::path page = folder_.path() / "page.html";
  EXPECT_TRUE(HasExited(RunForked([&] {
                          PartialFile file(page);
                          WriteText(file.partial(), "whole");
                          file.Commit();
                          std::raise(SIGINT);
                        }),
                        kExitCode));
  EXPECT_EQ(ReadText(page), "whole");
}

TEST_F(TemporaryPathTest, AChildRemovesNothingOfItsParents) {
  EXPECT_TRUE(HasExited(RunForked([&] {
                          const PartialFile file(folder_.path() / "page.html");
                          const pid_t child = ::fork();
                          if (child == 0) {
                            std::raise(SIGTERM);
                            ::_exit(EXIT_SUCCESS);
                          }
                          ::waitpid(child, nullptr, 0);
                          if (!fs::exists(file.partial())) ::_exit(10);
                          std::raise(SIGTERM);
                        }),
                        kExitCode));
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(TemporaryPathTest, MorePathsThanTheTableHoldsAreStillRemovedByTheirOwners) {
  std::vector<std::unique_ptr<PartialFile>> files;
  for (int k = 0; k < 300; ++k) {
    files.push_back(std::make_unique<PartialFile>(folder_.path() / std::to_string(k)));
  }
  files.clear();
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST(HandleSignals, AFileThatGrowsBeyondItsLimitIsAnError) {
  EXPECT_TRUE(HasExited(RunForked([] { std::raise(SIGXFSZ); }), EXIT_SUCCESS));
}

}  // namespace
}  // namespace dexcheck::testing::temporary_path_test
