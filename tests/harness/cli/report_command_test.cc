// dexcheck report: where it writes, and what it refuses.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>

#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/report/report_run.h"

namespace dexcheck::testing::report_command_test {
namespace {

namespace fs = std::filesystem;

class ReportCommandTest : public ::testing::Test {
 protected:
  [[nodiscard]] fs::path run_dir() const { return folder_.path() / "run"; }
  /// Whether only the log is in the run's folder.
  [[nodiscard]] bool HasOnlyLog() const {
    return std::distance(fs::directory_iterator(run_dir()), fs::directory_iterator()) == 1;
  }
  testing::TempFolder folder_;
};

TEST_F(ReportCommandTest, WritesPageAndFigures) {
  WriteReportRun(run_dir());
  const testing::ProgramResult result = RunDexcheck({"report", run_dir().string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, (run_dir() / "report.html").string() + "\n");
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(ReadText(run_dir() / "report.html"), HasSubstr("DISAGREEMENT"));
  EXPECT_TRUE(fs::exists(run_dir() / "figures/fig12a.png"));
}

TEST_F(ReportCommandTest, WritesThePageAlone) {
  WriteReportRun(run_dir());
  const fs::path page = folder_.path() / "page.html";
  const testing::ProgramResult result =
      RunDexcheck({"report", run_dir().string(), "--out", page.string(), "--quiet"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(ReadText(page), HasSubstr("</html>"));
  EXPECT_TRUE(HasOnlyLog());
}

TEST_F(ReportCommandTest, RefusesAFolderWithoutALog) {
  fs::create_directory(run_dir());
  EXPECT_TRUE(IsRefused(RunDexcheck({"report", run_dir().string()}), {"log.h5"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"report", (folder_.path() / "none").string()}), {"none/log.h5"}));
  EXPECT_TRUE(fs::is_empty(run_dir()));
}

TEST_F(ReportCommandTest, RefusesARunWithoutSteps) {
  ReportRun run;
  run.rows = 0;
  WriteReportRun(run_dir(), run);
  EXPECT_TRUE(IsRefused(RunDexcheck({"report", run_dir().string()}), {"log.h5", "no steps"}));
  EXPECT_TRUE(HasOnlyLog());
}

TEST_F(ReportCommandTest, RefusesOutputsThatCannotBeWritten) {
  WriteReportRun(run_dir());
  for (const fs::path& out : {folder_.path() / "none/page.html", folder_.path()}) {
    EXPECT_TRUE(IsRefused(RunDexcheck({"report", run_dir().string(), "--out", out.string()}),
                          {out.string(), "cannot be written"}));
  }
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"report", run_dir().string(), "--out", (folder_.path() / "page.pdf").string()}),
                {"page.pdf", "a page's name must end in .html"}));
  testing::WriteText(run_dir() / "figures", "a file");
  EXPECT_TRUE(IsRefused(RunDexcheck({"report", run_dir().string()}), {"figures", "cannot be made"}));
  EXPECT_FALSE(fs::exists(run_dir() / "report.html"));
}

TEST_F(ReportCommandTest, LeavesNothingOnAFullDisk) {
  WriteReportRun(run_dir());
  testing::ProgramOptions options;
  options.largest_file = 200'000;  // bytes: figures fit, the page does not
  const testing::ProgramResult result = RunDexcheck({"report", run_dir().string()}, options);
  EXPECT_TRUE(IsRefused(result, {"report.html", "cannot be written"}));
  EXPECT_TRUE(HasOnlyLog());
}

TEST_F(ReportCommandTest, SaysThatGnuplotIsMissing) {
  WriteReportRun(run_dir());
  testing::ProgramOptions options;
  options.environment = {{"PATH", folder_.path().string()}};
  EXPECT_TRUE(IsRefused(RunDexcheck({"report", run_dir().string()}, options), {"gnuplot", "gnuplot-nox"}));
  EXPECT_TRUE(HasOnlyLog());
}

}  // namespace
}  // namespace dexcheck::testing::report_command_test
