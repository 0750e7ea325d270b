// A process that writes a log is killed at random moments, for real. Whatever stands under the log's name
// then must open, here and with h5dump, and hold every row that was flushed.

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <random>
#include <thread>
#include <utility>

#include "tests/common/run_program.h"
#include "tests/harness/log/sample_log.h"

namespace dexcheck::testing::log_kill_test {
namespace {

constexpr long kRows = 4000;
constexpr long kMaxRows = 5000;  // Close trims
constexpr long kRowsPerFlush = 7;
constexpr int kKills = 120;
// On a busy machine many kills come too late; then more are tried.
constexpr int kMaxKills = 20 * kKills;

/// Progress that the process reports while it lives.
struct Progress {
  std::atomic<bool> has_started{false};
  std::atomic<long> flushed{0};
  std::atomic<bool> is_closing{false};
  std::atomic<bool> is_closed{false};
};

/// Memory that a process shares with those that it forks.
class SharedProgress {
 public:
  SharedProgress()
      : memory_(::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)),
        progress_(new (memory_) Progress) {}
  ~SharedProgress() { ::munmap(memory_, sizeof(Progress)); }
  SharedProgress(const SharedProgress&) = delete;
  SharedProgress& operator=(const SharedProgress&) = delete;

  Progress* operator->() const { return progress_; }

 private:
  void* memory_;
  Progress* progress_;
};

/// The victim's life.
[[noreturn]] void WriteLog(const std::filesystem::path& path, const SharedProgress& progress) {
  SampleLog log(path, kMaxRows, kRowsPerFlush);
  progress->has_started = true;
  for (long row = 0; row < kRows; ++row) {
    WriteSampleRow(&log);
    progress->flushed = (row + 1) / kRowsPerFlush * kRowsPerFlush;
  }
  log.Flush();
  progress->flushed = kRows;
  log.SetText("summary", "late");
  progress->is_closing = true;
  log.Close();
  progress->is_closed = true;
  ::_exit(0);
}

using Clock = std::chrono::steady_clock;

/// A writer in a process of its own.
class Victim {
 public:
  explicit Victim(const std::filesystem::path& path) : pid_(::fork()) {
    if (pid_ == 0) WriteLog(path, progress_);
  }
  ~Victim() { Kill(); }
  Victim(const Victim&) = delete;
  Victim& operator=(const Victim&) = delete;

  void Kill() {
    if (pid_ > 0) ::kill(pid_, SIGKILL);
    Wait();
  }
  void Wait() {
    if (pid_ > 0) ::waitpid(std::exchange(pid_, -1), nullptr, 0);
  }
  [[nodiscard]] bool has_started() const { return pid_ != -1; }
  [[nodiscard]] const SharedProgress& progress() const { return progress_; }

 private:
  SharedProgress progress_;
  pid_t pid_;
};

/// Returns once the condition holds; fails the test after a while.
template <typename Condition>
void WaitFor(const Condition& condition) {
  constexpr std::chrono::seconds kPatience{60};
  const Clock::time_point start = Clock::now();
  while (!condition()) {
    ASSERT_LT(Clock::now() - start, kPatience);
    std::this_thread::yield();
  }
}

/// Counts of what was found under the log's name.
struct Findings {
  int early = 0;    ///< Nothing: killed before the file was made.
  int amid = 0;     ///< Some of the rows.
  int closing = 0;  ///< Killed while Close was at work.
};

void CheckRemains(const std::filesystem::path& path, const SharedProgress& progress, Findings* findings) {
  if (!std::filesystem::exists(path)) {
    ASSERT_FALSE(progress->has_started);
    ++findings->early;
    return;
  }
  const LogReader log(path);
  ASSERT_GE(log.rows(), progress->flushed);
  ASSERT_TRUE(IsSample(log, log.rows()));
  if (progress->is_closed) ASSERT_EQ(log.ReadText("summary"), "late");
  if (progress->is_closing && !progress->is_closed) ++findings->closing;
  if (log.rows() > 0 && log.rows() < kRows) ++findings->amid;
}

class KilledWriter : public ::testing::Test {
 protected:
  /// Starts writers, waits as `wait(progress)` says, kills them and looks at what they leave; until
  /// `count` findings came.
  template <typename Wait>
  void KillMany(const Wait& wait, int Findings::*kind, int count) {
    const auto is_enough = [&] { return findings_.*kind >= count; };
    for (int i = 0; i < kKills || (i < kMaxKills && !is_enough()); ++i) {
      const std::filesystem::path path = folder_.path() / ("log" + std::to_string(i) + ".h5");
      Victim victim(path);
      ASSERT_TRUE(victim.has_started());
      wait(victim.progress());
      victim.Kill();
      ASSERT_NO_FATAL_FAILURE(CheckRemains(path, victim.progress(), &findings_));
      if (i % 10 == 0 && std::filesystem::exists(path)) {
        const ProgramResult dump = RunProgram({DEXCHECK_H5DUMP, path});
        ASSERT_EQ(dump.exit_code, 0) << dump.err;
        ASSERT_EQ(dump.err, "");
      }
      std::filesystem::remove(path);
    }
    EXPECT_TRUE(is_enough()) << findings_.*kind << " findings are too few to prove anything";
  }

  /// Evenly between 0 and 1.
  double Draw() { return std::uniform_real_distribution<>(0.0, 1.0)(random_); }

  TempFolder folder_;
  Findings findings_;

 private:
  std::mt19937 random_{1};
};

TEST_F(KilledWriter, BetweenRows) {
  KillMany(
      [&](const SharedProgress& progress) {
        const auto rows = static_cast<long>(0.95 * Draw() * kRows);
        WaitFor([&] { return progress->flushed >= rows; });
      },
      &Findings::amid, kKills / 4);
}

TEST_F(KilledWriter, WhileTheFileIsMade) {
  constexpr double kSeconds = 5e-3;
  KillMany(
      [&](const SharedProgress&) {
        std::this_thread::sleep_for(std::chrono::duration<double>(kSeconds * Draw()));
      },
      &Findings::early, kKills / 20);
}

TEST_F(KilledWriter, WhileClosing) {
  constexpr double kSeconds = 5e-3;
  KillMany(
      [&](const SharedProgress& progress) {
        WaitFor([&] { return progress->is_closing.load(); });
        std::this_thread::sleep_for(std::chrono::duration<double>(kSeconds * Draw()));
      },
      &Findings::closing, kKills / 20);
}

}  // namespace
}  // namespace dexcheck::testing::log_kill_test
