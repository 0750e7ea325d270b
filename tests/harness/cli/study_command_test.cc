// dexcheck study: interrupted, concurrent; the rows must come out the same.

#include "tests/harness/cli/study_command.h"

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "tests/common/matchers.h"

namespace dexcheck::testing::study_command_test {
namespace {

/// Largest error of the object after settling, m; a twentieth of the start error, measured 5e-9.
constexpr double kSettled = 5e-8;

TEST_F(StudyCommand, ClassifiesItsTrials) {
  Make("a.sqlite", {"--quiet"});
  const std::vector<TrialRow> rows = ReadRows("a.sqlite");
  ASSERT_EQ(rows.size(), kNumTrials);
  for (const TrialRow& row : rows) {
    const bool stable = row.trial.parameters[1] < 2000.0;
    EXPECT_EQ(row.result.outcome == Outcome::kTracked, stable) << row.trial.number;
    EXPECT_EQ(row.result.failure.empty(), stable) << row.result.failure;
    if (!stable) continue;
    EXPECT_NEAR(row.result.metrics[kPositionErrorMax], 1e-6, kSettled) << "the start error is the largest";
    EXPECT_LT(row.result.metrics[kPositionErrorRms], 1e-6);
    EXPECT_GT(row.result.metrics[kPositionErrorRms], 0.0);
    EXPECT_GT(row.result.metrics[kConeMargin], 0.0);
    EXPECT_GT(row.result.metrics[kPeakEffort], 0.0);
    EXPECT_LT(row.result.metrics[kPeakEffort], 1.0);
    EXPECT_GT(row.result.metrics[kEnergy], 0.0);
  }
}

TEST_F(StudyCommand, TheNumberOfProcessesDoesNotMatter) {
  for (const std::string jobs : {"1", "2", "6"}) {
    Make(jobs + ".sqlite", {"--jobs", jobs});
    EXPECT_EQ(Dump(jobs + ".sqlite"), Reference()) << jobs;
  }
}

/// How many transactions changed a database file since it was made.
long CountTransactions(const std::string& path) {
  constexpr std::streamoff kChangeCounter = 24;  // in the file's header, 4 bytes, the highest first
  std::ifstream file(path, std::ios::binary);
  file.seekg(kChangeCounter);
  long count = 0;
  for (int i = 0; i < 4; ++i) count = 256 * count + file.get();
  return count;
}

TEST_F(StudyCommand, ShortTrialsFractionTransactionsWithOneJobToo) {
  constexpr long kTrials = 100;
  Write("tiny.toml", R"(name = "tiny"
scenario = "hold"
set = ["duration=0.001", "settle=0.001"]
[[vary]]
key = "control.natural_frequency"
from = 5
to = 50
count = 100
)");
  const auto begun = std::chrono::steady_clock::now();
  Make("a.sqlite", {"--jobs", "1"});
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  ASSERT_EQ(CountRows("a.sqlite"), kTrials);
  // One to store and one to claim in 0.2 s; some more at first, when it is not known how many 0.2 s take.
  constexpr long kFirst = 20;
  EXPECT_LE(CountTransactions(Path("a.sqlite")), kFirst + std::lround(2.0 * seconds / 0.2));
}

TEST_F(StudyCommand, GivesTheSameRowsHoweverOftenItIsKilled) {
  const std::string reference = Reference();
  std::mt19937 random(5);
  std::uniform_int_distribution<int> milliseconds(20, 400);
  constexpr int kKills = 20;
  int unfinished = 0;
  for (int i = 0; i < kKills; ++i) {
    {
      const Program killed(DexcheckCommand(RunArguments("a.sqlite", {"--jobs", "2"})), {});
      std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds(random)));
    }
    if (CountRows("a.sqlite") < static_cast<long>(kNumTrials)) {
      ++unfinished;
      continue;
    }
    // Done in spite of it all: once more from the beginning.
    EXPECT_EQ(Dump("a.sqlite"), reference) << i;
    std::filesystem::remove(Path("a.sqlite"));
  }
  EXPECT_GE(unfinished, 5) << "it was killed too late to matter";
  Make("a.sqlite");
  EXPECT_EQ(Dump("a.sqlite"), reference);
}

TEST_F(StudyCommand, TwoWritersLoseNothing) {
  const std::string reference = Reference();
  Program one(DexcheckCommand(RunArguments("a.sqlite", {"--jobs", "1"})), {});
  Program other(DexcheckCommand(RunArguments("a.sqlite", {"--jobs", "1"})), {});
  const ProgramResult first = one.Wait();
  const ProgramResult second = other.Wait();
  // The one that ends first may leave a last trial to the other.
  EXPECT_TRUE(first.exit_code == 0 || second.exit_code == 0) << first.err << second.err;
  for (const ProgramResult& result : {first, second}) {
    if (result.exit_code != 0) EXPECT_THAT(result.err, HasSubstr("another process has them"));
  }
  EXPECT_EQ(Dump("a.sqlite"), reference);
}

TEST_F(StudyCommand, CtrlCEndsItInGoodOrder) {
  Program program(DexcheckCommand(RunArguments("a.sqlite", {"--jobs", "1"})), {});
  while (!Has("a.sqlite")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("interrupted"));
  Make("a.sqlite");
  EXPECT_EQ(Dump("a.sqlite"), Reference());
}

TEST_F(StudyCommand, AnEditedStudyNeedsAnotherDatabase) {
  Make("a.sqlite", {"--quiet"});
  const std::string before = Dump("a.sqlite");
  WriteChanged("tiny.toml", kStudy, "[20, 200, 2100]", "[300, 20, 200]");
  EXPECT_TRUE(
      Refused(RunArguments("a.sqlite"), {"a.sqlite: is of another study: key vary differs; each study "
                                         "needs a database file of its own"}));
  EXPECT_EQ(Dump("a.sqlite"), before);
  // A comment is no change.
  Write("tiny.toml", "# back\n" + kStudy);
  EXPECT_THAT(Make("a.sqlite").out, HasSubstr("tiny: 6 of 6 trials"));
}

TEST_F(StudyCommand, TheReportsCommandsRepeatTheTrials) {
  Make("a.sqlite", {"--quiet"});
  const ProgramResult page = Expect(0, "study report a.sqlite --page -");
  EXPECT_THAT(page.out, StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(page.out, EndsWith("</html>\n"));
  const auto trial = RunJson(0, "study show a.sqlite 4");
  const auto shown = trial["command"].get<std::string>();
  EXPECT_THAT(shown, HasSubstr("--set control.K_p=10000 --set control.K_v=200"));
  const std::filesystem::path program = ProgramPath();
  ProgramOptions options;
  options.folder = folder_.path();
  options.environment = {{"PATH", program.parent_path().string() + ":" + ::getenv("PATH")}};
  const ProgramResult replay = RunProgram({"sh", "-c", shown}, options);
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_EQ(Read("trial-4/video.mp4").substr(4, 4), "ftyp");
  // The number is the same bit for bit.
  const auto summary = ReadJson("trial-4/summary.json");
  const std::vector<TrialRow> rows = ReadRows("a.sqlite");
  EXPECT_EQ(summary["tracking"]["position_error_rms_m"].get<double>(),
            rows[4].result.metrics[kPositionErrorRms]);
}

}  // namespace
}  // namespace dexcheck::testing::study_command_test
