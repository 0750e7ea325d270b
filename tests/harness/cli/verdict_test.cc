// The verdict of a run comes before anything optional, and neither a missing drawing nor a standard stream
// that is closed or full changes what was recorded.

#include <unistd.h>

#include "harness/log/log_reader.h"
#include "tests/common/refused_text.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::verdict_test {
namespace {

namespace fs = std::filesystem;

class Verdict : public CommandTest {
 protected:
  [[nodiscard]] ProgramResult RunHold(const ProgramOptions& options, const Words& more = "") const {
    return Run(Words("run hold --set duration=0.05 --set settle=0.1 --out run") + more, options);
  }
  [[nodiscard]] std::string GetVerdict() const { return ReadJson("run/summary.json").at("verdict"); }
  [[nodiscard]] bool IsRecorded(const std::string& verdict = "pass") const {
    return Has("run/summary.json") && GetVerdict() == verdict && LogReader(Path("run/log.h5")).rows() == 50;
  }
};

TEST_F(Verdict, StandsWithoutATemporaryFolder) {
  const std::string missing = Path("missing");
  const ProgramOptions options = {.environment = {{"TMPDIR", missing}}};
  const ProgramResult result = RunHold(options, "--video");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  // One line each for the video and the report.
  EXPECT_EQ(std::ranges::count(result.err, '\n'), 2);
  for (const char* what : {"dexcheck: no video: TMPDIR: ", "dexcheck: no report: TMPDIR: "})
    EXPECT_THAT(result.err, HasSubstr(what));
  EXPECT_TRUE(IsRecorded());
  // One line names the folder where it is not optional.
  for (const char* command : {"run --replay run", "report run"})
    EXPECT_TRUE(IsRefused(Run(command, options), {"TMPDIR", missing}));
}

TEST_F(Verdict, OfADisagreementStandsWithoutGnuplot) {
  const ProgramResult result =
      RunHold({.environment = {{"PATH", folder_.path().string()}}}, "--set model.object.mass=0.3");
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_TRUE(IsOneLineWith(result.err, {"no report", "gnuplot"}));
  EXPECT_TRUE(IsRecorded("disagreement"));
}

TEST_F(Verdict, ThatCannotBePrintedStillLeavesLogAndReport) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_TRUE(IsRefused(RunHold({.out = "/dev/full"}), {"standard output: ", "No space left on device"}));
  EXPECT_TRUE(IsRecorded());
  EXPECT_TRUE(Has("run/report.html"));
}

/// Otherwise the log would get the number of a closed stream, and what is printed.
TEST_F(Verdict, ClosedStreamsDoNotWriteIntoTheLog) {
  ProgramOptions options;
  options.closed = {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO};
  EXPECT_EQ(RunHold(options, "--no-report").exit_code, 2) << "the verdict could not be printed";
  EXPECT_TRUE(IsRecorded());
  fs::remove_all(Path("run"));
  options.closed = {STDERR_FILENO};
  EXPECT_EQ(RunHold(options, "--no-report").exit_code, 0);
  EXPECT_TRUE(IsRecorded());
}

TEST(StandardError, ClosedOrFullChangesNoExitCode) {
  for (const char* command : {"run papper", "render /nowhere", "--nothing"}) {
    EXPECT_EQ(RunDexcheck(command, {.err = "/dev/full"}).exit_code, 2) << command;
    EXPECT_EQ(RunDexcheck(command, {.closed = {STDERR_FILENO}}).exit_code, 2) << command;
  }
}

TEST(StandardOutput, FullIsNoticedByWhateverPrints) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  for (const char* command : {"--help", "run --help", "--version", "run --list"}) {
    EXPECT_TRUE(IsRefused(RunDexcheck(command, {.out = "/dev/full"}),
                          {"standard output: cannot be written: No space left on device"}))
        << command;
    EXPECT_TRUE(IsRefused(RunDexcheck(command, {.closed = {STDOUT_FILENO}}),
                          {"standard output: cannot be written: Bad file descriptor"}))
        << command;
  }
}

// A declared imperfection is no fault of the law: the run without it shows how much it explains.
TEST_F(Verdict, ADeclaredMismatchIsTheCauseOfAMissedExpectation) {
  const Json result = RunJson(
      1, "run paper --no-log --set duration=0.3 --set 'mismatch.mass={ torso = 1.03 }'")["attribution"];
  EXPECT_EQ(result["cause"], "declared imperfections");
  EXPECT_THAT(result["evidence"].get<std::string>(), HasSubstr("mismatch.mass"));
  EXPECT_THAT(result["evidence"].get<std::string>(), HasSubstr("that explains 100 % of the error"));
}

// A rigid plant integrates the equations that its forces are put into.
TEST_F(Verdict, ARigidPlantIsNoEvidenceOfItsOwnEquations) {
  const ProgramResult run = Expect(0, "run paper-rigid --no-report --set duration=0.02 --out run");
  EXPECT_THAT(run.out, HasSubstr("same source"));
  EXPECT_THAT(run.out, HasSubstr("not judged: inverse dynamics\n  (model and plant are one file)"));
  EXPECT_EQ(ReadJson("run/summary.json")["checks"]["contact_force"]["same_source"], true);
}

}  // namespace
}  // namespace dexcheck::testing::verdict_test
