// The verdict of a run comes before anything optional, and neither a missing drawing nor a standard stream
// that is closed or full changes what was recorded.

#include <gmock/gmock.h>
#include <unistd.h>

#include "harness/log/log_reader.h"
#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::verdict_test {
namespace {

namespace fs = std::filesystem;

class Verdict : public ::testing::Test {
 protected:
  [[nodiscard]] fs::path run_dir() const { return folder_.path() / "run"; }
  [[nodiscard]] ProgramResult Run(const ProgramOptions& options, std::vector<std::string> more = {},
                                  const char* scenario = "hold") const {
    std::vector<std::string> arguments = {"run",   scenario,     "--set", "duration=0.05",
                                          "--set", "settle=0.1", "--out", run_dir().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunDexcheck(arguments, options);
  }
  [[nodiscard]] bool IsRecorded() const {
    return fs::exists(run_dir() / "summary.json") && LogReader(run_dir() / "log.h5").rows() == 50;
  }

  testing::TempFolder folder_;
};

TEST_F(Verdict, StandsWithoutATemporaryFolder) {
  ProgramOptions options;
  options.environment = {{"TMPDIR", (folder_.path() / "missing").string()}};
  const ProgramResult result = Run(options, {"--video"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("\nPASS: "));
  const std::string reason =
      "TMPDIR: must name a folder, got \"" + (folder_.path() / "missing").string() + "\"\n";
  EXPECT_EQ(result.err, "dexcheck: no video: " + reason + "dexcheck: no report: " + reason);
  EXPECT_TRUE(IsRecorded());
  // Where it is not optional, one line says so.
  EXPECT_TRUE(IsRefused(RunDexcheck({"run", "--replay", run_dir().string()}, options), {"TMPDIR"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"report", run_dir().string()}, options), {"TMPDIR"}));
}

TEST_F(Verdict, OfADisagreementStandsWithoutGnuplot) {
  ProgramOptions options;
  options.environment = {{"PATH", folder_.path().string()}};
  const ProgramResult result = Run(options, {"--set", "model.object.mass=0.3"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("\nDISAGREEMENT:\n"));
  EXPECT_THAT(result.err, ::testing::StartsWith("dexcheck: no report: gnuplot: cannot be run"));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1);
  EXPECT_TRUE(IsRecorded());
}

TEST_F(Verdict, ThatCannotBePrintedStillLeavesLogAndReport) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  ProgramOptions options;
  options.out = "/dev/full";
  const ProgramResult result = Run(options);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.err, "dexcheck: standard output: cannot be written: No space left on device\n");
  EXPECT_TRUE(IsRecorded());
  EXPECT_TRUE(fs::exists(run_dir() / "report.html"));
}

/// Otherwise the log would get the number of a closed stream, and what is printed.
TEST_F(Verdict, ClosedStreamsDoNotWriteIntoTheLog) {
  ProgramOptions options;
  options.closed = {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO};
  EXPECT_EQ(Run(options, {"--no-report"}).exit_code, 2) << "the verdict could not be printed";
  EXPECT_TRUE(IsRecorded());
  fs::remove_all(run_dir());
  options.closed = {STDERR_FILENO};
  const ProgramResult result = Run(options, {"--no-report"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("\nPASS: "));
  EXPECT_TRUE(IsRecorded());
}

TEST(StandardError, ClosedOrFullChangesNoExitCode) {
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"run", "papper"}, {"render", "/nowhere"}, {"--nothing"}}) {
    ProgramOptions options;
    options.err = "/dev/full";
    EXPECT_EQ(RunDexcheck(command, options).exit_code, 2) << command[0];
    options.err.reset();
    options.closed = {STDERR_FILENO};
    EXPECT_EQ(RunDexcheck(command, options).exit_code, 2) << command[0];
  }
}

TEST(StandardOutput, FullIsNoticedByWhateverPrints) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"--help"}, {"run", "--help"}, {"--version"}, {"run", "--list"}}) {
    ProgramOptions options;
    options.out = "/dev/full";
    EXPECT_TRUE(IsRefused(RunDexcheck(command, options),
                          {"standard output: cannot be written: No space left on device"}))
        << command[0];
    options.out.reset();
    options.closed = {STDOUT_FILENO};
    EXPECT_TRUE(
        IsRefused(RunDexcheck(command, options), {"standard output: cannot be written: Bad file descriptor"}))
        << command[0];
  }
}

TEST_F(Verdict, OptionsThatWouldBeIgnoredAreRefused) {
  const auto refused = [&](std::vector<std::string> arguments, const std::vector<std::string>& parts) {
    arguments.insert(arguments.begin(), "run");
    return IsRefused(RunDexcheck(arguments), parts);
  };
  EXPECT_TRUE(refused({"hold", "--video", "--no-log"}, {"--video", "--no-log"}));
  EXPECT_TRUE(refused({"hold", "--no-log", "--out", run_dir().string()}, {"--no-log", "--out"}));
  EXPECT_TRUE(refused({"--replay", "x", "--video"}, {"--replay", "--video"}));
  EXPECT_TRUE(refused({"--replay", "x", "--set", "duration=1"}, {"--replay", "--set"}));
  EXPECT_TRUE(refused({"--replay", "x", "--seed", "1"}, {"--replay", "--seed"}));
  EXPECT_TRUE(refused({"--list", "--out", "x"}, {"--list", "--out"}));
  EXPECT_FALSE(fs::exists(run_dir()));
}

}  // namespace
}  // namespace dexcheck::testing::verdict_test
