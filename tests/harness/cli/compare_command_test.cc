// dexcheck compare: exit codes and what is compared.

#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/report/report_run.h"

namespace dexcheck::testing::compare_command_test {
namespace {

using CompareCommand = CommandTest;

TEST_F(CompareCommand, ExitsWithOneAboveTheTolerance) {
  WriteReportRun(Path("a"));
  WriteReportRun(Path("b"), {.rows = 300});
  EXPECT_EQ(RunJson(0, "compare a a --tolerance 0").at("same"), true);
  Expect(1, "compare a b --tolerance 1");
  Expect(0, "compare a b");  // without a tolerance nothing is judged
  const Json json = RunJson(0, "compare a b --out page.html");
  EXPECT_EQ(json.at("results").at("simulated").at("values"), Json({0.4, 0.3}));
  EXPECT_TRUE(Has("page.html"));
}

}  // namespace
}  // namespace dexcheck::testing::compare_command_test
