// dexcheck report: where it writes, and what it refuses; dexcheck compare: exit codes and what is compared.

#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/report/report_run.h"

namespace dexcheck::testing::report_command_test {
namespace {

class ReportCommand : public CommandTest {
 protected:
  ReportCommand() { WriteReportRun(Path("run")); }
};

TEST_F(ReportCommand, WritesPageAndFigures) {
  const ProgramResult result = Expect(0, "report run");
  EXPECT_EQ(result.out, "run/report.html\n");
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(Read("run/report.html"), HasSubstr("DISAGREEMENT"));
  EXPECT_TRUE(Has("run/figures/fig12a.png"));
}

TEST_F(ReportCommand, WritesThePageAlone) {
  EXPECT_EQ(Expect(0, "report run --page page.html --quiet").out, "");
  EXPECT_THAT(Read("page.html"), HasSubstr("</html>"));
  EXPECT_EQ(CountFiles("run"), 1);
}

TEST_F(ReportCommand, WritesATableForLatex) {
  const std::string table = Expect(0, "report run --tex -").out;
  EXPECT_THAT(table, HasSubstr("\\bottomrule"));
  EXPECT_EQ(Expect(0, "report run --tex run/table.tex").out, "run/report.html\n");
  EXPECT_EQ(Read("run/table.tex"), table);
}

TEST_F(ReportCommand, RefusesARunWithoutSteps) {
  WriteReportRun(Path("empty"), {.rows = 0});
  EXPECT_TRUE(Refused("report empty", {"log.h5", "no steps"}));
  EXPECT_EQ(CountFiles("empty"), 1);
}

TEST_F(ReportCommand, LeavesNothingWhereItCannotWrite) {
  // Bytes: figures fit, the page does not.
  EXPECT_TRUE(IsRefused(Run("report run", {.largest_file = 200'000}), {"report.html", "cannot be written"}));
  EXPECT_TRUE(IsRefused(Run("report run", {.environment = {{"PATH", folder_.path().string()}}}),
                        {"gnuplot", "gnuplot-nox"}));
  EXPECT_EQ(CountFiles("run"), 1);
  Write("run/figures", "a file");
  EXPECT_TRUE(Refused("report run", {"figures", "cannot be made"}));
  EXPECT_FALSE(Has("run/report.html"));
}

using CompareCommand = CommandTest;

TEST_F(CompareCommand, ExitsWithOneAboveTheTolerance) {
  WriteReportRun(Path("a"));
  WriteReportRun(Path("b"), {.rows = 300});
  EXPECT_EQ(RunJson(0, "compare a a --tolerance 0").at("same"), true);
  Expect(1, "compare a b --tolerance 1");
  Expect(0, "compare a b");  // without a tolerance nothing is judged
  const Json json = RunJson(0, "compare a b --page page.html");
  EXPECT_EQ(json.at("results").at("simulated").at("values"), Json({0.4, 0.3}));
  EXPECT_TRUE(Has("page.html"));
}

}  // namespace
}  // namespace dexcheck::testing::report_command_test
