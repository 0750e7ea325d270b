// dexcheck study on machines that fail: killed processes, time limits, full disks.

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "tests/common/matchers.h"
#include "tests/harness/cli/study_command.h"

namespace dexcheck::testing::study_faults_test {
namespace {

// One trial that takes about two seconds of processor time, and one that takes none to speak of.
const std::string kSlowStudy = R"(name = "slow"
scenario = "offset"
set = ["settle=0.3"]
[[vary]]
key = "duration"
values = [20, 0.02]
)";

TEST_F(StudyCommand, ATrialThatIsAlwaysKilledEndsNoStudyAndCanBeRetried) {
  Write("tiny.toml", kSlowStudy);
  std::vector<std::string> limited = DexcheckCommand(RunArguments("a.sqlite", {"--jobs", "2"}));
  // With a hard limit of its processor time the system kills every process that takes more.
  limited.insert(limited.begin(), {"prlimit", "--cpu=1:1"});
  const ProgramResult result = RunProgram(limited);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("--retry-failed"));
  std::vector<TrialRow> rows = ReadRows("a.sqlite");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].result.outcome, Outcome::kCrashed);
  EXPECT_EQ(rows[0].result.failure, "the process was killed from outside: Killed, 3 times");
  EXPECT_EQ(rows[1].result.outcome, Outcome::kTracked);
  const std::string before = Dump("a.sqlite");
  Make("a.sqlite");
  EXPECT_EQ(Dump("a.sqlite"), before) << "not unless requested";
  const ProgramResult retried = Make("a.sqlite", {"--retry-failed"});
  rows = ReadRows("a.sqlite");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].result.outcome, Outcome::kTracked) << rows[0].result.failure;
  EXPECT_EQ(rows[0].result.metrics[kSimulatedTime], 20.0);
}

TEST_F(StudyCommand, TrialsHaveATimeLimit) {
  Write("tiny.toml", "trial_time_limit = 0.5\n" + kSlowStudy);
  Make("a.sqlite");
  const std::vector<TrialRow> rows = ReadRows("a.sqlite");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].result.outcome, Outcome::kTimedOut);
  EXPECT_THAT(rows[0].result.failure, HasSubstr("trial_time_limit, 0.5 s"));
  EXPECT_EQ(rows[1].result.outcome, Outcome::kTracked);
  const ProgramResult report = Expect(0, "study report a.sqlite --page -");
  EXPECT_THAT(report.out, HasSubstr("timed out"));
}

TEST_F(StudyCommand, AFullDiskLosesNothing) {
  Make("a.sqlite", {"--shard", "1/2"});
  const std::string before = Dump("a.sqlite");
  ProgramOptions full;
  full.largest_file = 4096;
  EXPECT_TRUE(IsRefused(Run(RunArguments("a.sqlite"), full), {"a.sqlite: cannot be written"}));
  EXPECT_EQ(Dump("a.sqlite"), before);
  Make("a.sqlite");
  EXPECT_EQ(Dump("a.sqlite"), Reference());
}

// On a file system of its own, which only a process in a name space of its own may mount.
TEST_F(StudyCommand, AFullFileSystemLosesNothing) {
  const std::vector<std::string> apart = {"unshare", "--map-root-user", "--mount", "sh", "-euc"};
  const std::string mount = "mount -t tmpfs -o size=128k tmpfs \"$1\"";
  const auto run = [&](const std::string& script) {
    std::vector<std::string> command = apart;
    command.insert(command.end(), {script, "sh", folder_.path() / "disk", folder_.path() / "tiny.toml",
                                   folder_.path(), ProgramPath()});
    return RunProgram(command);
  };
  std::filesystem::create_directory(folder_.path() / "disk");
  if (run(mount).exit_code != 0) GTEST_SKIP() << "no file system may be mounted here";
  Make("a.sqlite", {"--shard", "1/2"});
  const std::string before = Dump("a.sqlite");
  const ProgramResult result = run(mount + R"(
    cp "$3/a.sqlite" "$1"
    dd if=/dev/zero of="$1/filler" bs=4k 2>"$3/dd.txt" && exit 99
    code=0
    "$4" study run "$2" --db "$1/a.sqlite" --jobs 1 || code=$?
    ls "$1" >"$3/left.txt"
    cp "$1/a.sqlite" "$3/full.sqlite"
    rm "$1/filler"
    "$4" study run "$2" --db "$1/a.sqlite" --quiet
    cp "$1/a.sqlite" "$3/freed.sqlite"
    exit $code)");
  EXPECT_TRUE(IsRefused(result, {"disk/a.sqlite: cannot be written: database or disk is full"}));
  EXPECT_EQ(Read("left.txt"), "a.sqlite\nfiller\n");
  EXPECT_EQ(Dump("full.sqlite"), before);
  EXPECT_EQ(Dump("freed.sqlite"), Reference());
}

// Who reads a database for long keeps rows from being written meanwhile, and no more than that.
TEST_F(StudyCommand, WaitsForAnotherProgramThatReads) {
  Make("db.sqlite", {"--shard", "1/2"});
  SQLite::Database other = OpenDatabase(Path("db.sqlite"));
  other.exec("BEGIN");
  (void)other.execAndGet("SELECT count(*) FROM trials");
  ProgramOptions options;
  options.folder = Path("");
  options.err = Path("said.txt");
  Program study(DexcheckCommand(RunArguments("db.sqlite")), options);
  const auto said = [&] { return std::filesystem::exists(Path("said.txt")) ? Read("said.txt") : ""; };
  for (int k = 0; k < 600 && said().find("another program uses it") == std::string::npos; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_THAT(said(), HasSubstr("db.sqlite: another program uses it; waiting until it ends"));
  other.exec("COMMIT");
  EXPECT_EQ(study.Wait().exit_code, 0) << said();
  EXPECT_EQ(other.execAndGet("SELECT count(*) FROM trials").getInt(), static_cast<int>(kNumTrials));
}

TEST_F(StudyCommand, AReadOnlyDatabaseIsNamed) {
  Make("a.sqlite", {"--shard", "1/2"});
  const std::string before = Dump("a.sqlite");
  std::vector<std::string> command = DexcheckCommand(RunArguments("a.sqlite"));
  ::chmod(Path("a.sqlite").c_str(), 0444);
  if (::geteuid() == 0) {
    // Root may write everything; nobody may not.
    ::chmod(folder_.path().c_str(), 0755);
    command.insert(command.begin(), {"setpriv", "--reuid=65534", "--clear-groups"});
  }
  EXPECT_TRUE(IsRefused(RunProgram(command), {"a.sqlite: cannot be written: it is read-only"}));
  EXPECT_EQ(Dump("a.sqlite"), before);
}

}  // namespace
}  // namespace dexcheck::testing::study_faults_test
