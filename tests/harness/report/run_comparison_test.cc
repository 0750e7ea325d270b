// Recorded runs side by side.

#include "harness/report/run_comparison.h"

#include <gmock/gmock.h>

#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/harness/report/report_run.h"

namespace dexcheck::testing::run_comparison_test {
namespace {

/// A run with one pose, x = slope * t, in rows of a time step.
void WriteLine(const std::filesystem::path& folder, double time_step, double slope,
               const std::string& overrides, double not_finite_from = 1e9) {
  std::filesystem::create_directories(folder);
  LogWriter log(folder / "log.h5", 1000);
  log.SetText("scenario", "line");
  log.SetText("overrides", overrides);
  log.EmbedFile("inputs", "scenario.toml", "slope = " + std::to_string(slope));
  const int pose = log.AddSignal({"object/X_o", "m, m, rad", "pose", 3, {"x", "y", "phi"}, {}});
  const int check = log.AddSignal({"check/M_bar", "1", "check", 1, {}, {{"bound", 1e-13}, {"kind", 0.0}}});
  const int law = log.AddSignal({"check/law_torque", "1", "check", 1, {}, {{"bound", 1e-12}, {"kind", 4.0}}});
  log.StartRows();
  for (int row = 0; row * time_step <= 0.5 + 1e-9; ++row) {
    const double t = row * time_step;
    log.Row(LogWriter::kTime)[0] = t;
    log.Row(pose)[0] = t < not_finite_from ? slope * t : std::nan("");
    log.Row(pose)[1] = 1000.0;
    log.Row(pose)[2] = 0.25;
    log.Row(check)[0] = slope * 1e-16;
    log.Row(law)[0] = 1e-16;
    log.EndRow();
  }
  log.Close();
}

class RunComparisonTest : public ::testing::Test {
 protected:
  RunComparison Compare(const char* a, const char* b, const RunComparisonOptions& options = {}) {
    const RunData first(folder_.path() / a), second(folder_.path() / b);
    return CompareRuns({&first, &second}, options);
  }
  TempFolder folder_;
};

TEST_F(RunComparisonTest, ARunIsTheSameAsItself) {
  WriteReportRun(folder_.path());
  const RunComparison comparison = Compare("", "");
  EXPECT_TRUE(comparison.IsSame());
  EXPECT_THAT(comparison.inputs, IsEmpty());
  EXPECT_THAT(comparison.not_compared, IsEmpty());
  ASSERT_GT(comparison.signals.size(), 5U);
  for (const SignalDifference& signal : comparison.signals) EXPECT_EQ(signal.difference, 0.0) << signal.name;
  for (const ComparedNumber& check : comparison.checks) {
    if (*check.values[0] != 0.0) EXPECT_EQ(check.CalcRatio(1), 1.0) << check.name;
  }
}

// x differs by 1e-3 t of at most 0.5: 1e-3 of its size, while y of 1000 m is equal.
TEST_F(RunComparisonTest, ASignalIsJudgedByTheSizeOfItsUnit) {
  WriteLine(folder_.path() / "a", 0.01, 1.0, "");
  WriteLine(folder_.path() / "b", 0.01, 1.001, "");
  // In metres y is the size.
  RunComparison comparison = Compare("a", "b", {4e-7, {}});
  ASSERT_EQ(comparison.signals.size(), 1U);
  const SignalDifference& signal = comparison.signals[0];
  EXPECT_EQ(signal.column, "x");
  EXPECT_NEAR(signal.difference, 5e-4, 1e-15);
  EXPECT_EQ(signal.size, 1000.0);
  EXPECT_NEAR(signal.at_time, 0.5, 1e-12);
  // 1e-3 t > 4e-7 * 1000 m from 0.41 s on.
  EXPECT_TRUE(signal.differs);
  EXPECT_NEAR(signal.first_time, 0.41, 1e-12);
  EXPECT_FALSE(comparison.IsSame());
  EXPECT_EQ(MakeAnswer(comparison).sentence, "1 of 1 signals, first object/X_o.x at 0.410 s.");
  comparison = Compare("a", "b", {6e-7, {}});
  EXPECT_TRUE(comparison.IsSame());
  // Residuals of checks are rounding: they stand side by side and decide nothing.
  ASSERT_EQ(comparison.checks.size(), 2U);
}

TEST_F(RunComparisonTest, OtherStepsAreComparedAlongLines) {
  WriteLine(folder_.path() / "a", 0.01, 1.0, "");
  WriteLine(folder_.path() / "b", 0.02, 1.0, "");
  WriteLine(folder_.path() / "c", 0.02, 1.5, "");
  EXPECT_TRUE(Compare("a", "b", {1e-12, {}}).IsSame());
  const RunComparison comparison = Compare("a", "c");
  // x differs by 0.5 t at each of the first run's rows.
  EXPECT_NEAR(comparison.signals[0].difference, 0.25, 1e-12);
  EXPECT_NEAR(comparison.signals[0].first_time, 0.01, 1e-12);
}

TEST_F(RunComparisonTest, NumbersAgainstNoneAreAnInfiniteDifference) {
  WriteLine(folder_.path() / "a", 0.01, 1.0, "");
  WriteLine(folder_.path() / "b", 0.01, 1.0, "", 0.3);
  const RunComparison comparison = Compare("a", "b", {1.0, {}});
  EXPECT_FALSE(comparison.IsSame());
  EXPECT_NEAR(comparison.FindFirst()->first_time, 0.3, 1e-12);
}

TEST_F(RunComparisonTest, InputsThatDifferAreNamed) {
  WriteLine(folder_.path() / "a", 0.01, 1.0, "");
  WriteLine(folder_.path() / "b", 0.01, 1.0, "mu=0.5\nseed=3\n");
  WriteLine(folder_.path() / "c", 0.01, 2.0, "");
  RunComparison comparison = Compare("a", "b");
  ASSERT_EQ(comparison.inputs.size(), 1U);
  EXPECT_EQ(comparison.inputs[0].name, "overrides");
  EXPECT_EQ(comparison.inputs[0].values[1], "mu=0.5 seed=3");
  comparison = Compare("a", "c");
  ASSERT_EQ(comparison.inputs.size(), 1U);
  EXPECT_EQ(comparison.inputs[0].name, "scenario.toml");
}

TEST_F(RunComparisonTest, OtherVerdictsAreADifference) {
  WriteReportRun(folder_.path() / "a");
  WriteReportRun(folder_.path() / "b", {.verdict = "pass"});
  const RunComparison comparison = Compare("a", "b", {1.0, {}});
  EXPECT_EQ(comparison.verdicts[0], "disagreement: wheel slip");
  EXPECT_EQ(comparison.verdicts[1], "pass");
  EXPECT_FALSE(comparison.IsSame());
}

TEST_F(RunComparisonTest, SignalsOfOneRunAloneAreSaid) {
  WriteReportRun(folder_.path() / "a");
  WriteLine(folder_.path() / "b", 0.01, 1.0, "");
  const RunComparison comparison = Compare("a", "b");
  EXPECT_THAT(comparison.not_compared, Contains("tau"));
}

TEST_F(RunComparisonTest, NothingOfTheLogsIsMarkup) {
  WriteReportRun(folder_.path() / "a");
  WriteLine(folder_.path() / "b", 0.01, 1.0, "<script>alert(1)</script>");
  const RunData a(folder_.path() / "a");
  const RunData b(folder_.path() / "b");
  const std::string page = MakeComparisonPage({&a, &b}, {"<i>a</i>", "b"}, CompareRuns({&a, &b}, {}));
  EXPECT_THAT(page, HasSubstr("\\u003cscript>alert(1)"));
  EXPECT_THAT(page, Not(HasSubstr("<script>alert(1)")));
  EXPECT_THAT(page, Not(HasSubstr("<i>a</i>")));
}

// A run that was cut off has no summary: its checks are read from their signals, the law's among them.
TEST_F(RunComparisonTest, ChecksOfARunWithoutSummaryKeepTheirCategory) {
  WriteLine(folder_.path(), 0.01, 1.0, "");
  const RunData run(folder_.path());
  for (const CheckRecord& check : run.checks())
    EXPECT_EQ(check.kind, check.name == "law_torque" ? CheckCategory::kLaw : CheckCategory::kModel)
        << check.name;
}

}  // namespace
}  // namespace dexcheck::testing::run_comparison_test
