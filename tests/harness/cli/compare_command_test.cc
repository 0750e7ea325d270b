// dexcheck compare: exit codes and what is printed.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/report/report_run.h"

namespace dexcheck::testing::compare_command_test {
namespace {

TEST(CompareCommand, ExitsWithOneAboveTheTolerance) {
  const testing::TempFolder folder;
  const std::string a = folder.path() / "a";
  const std::string b = folder.path() / "b";
  testing::WriteReportRun(a);
  testing::ReportRun shorter;
  shorter.rows = 300;
  testing::WriteReportRun(b, shorter);

  ProgramResult result = RunDexcheck({"compare", a, a, "--tolerance", "0"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, ::testing::HasSubstr("SAME: "));
  result = RunDexcheck({"compare", a, b, "--tolerance", "1"});
  EXPECT_EQ(result.exit_code, 1) << result.out;
  EXPECT_EQ(RunDexcheck({"compare", a, b}).exit_code, 0) << "without a tolerance nothing is judged";
  result = RunDexcheck({"compare", a, b, "--json", "-", "--out", folder.path() / "page.html"});
  const nlohmann::json json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("results").at("simulated").at("values"), nlohmann::json({0.4, 0.3}));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "page.html"));
}

TEST(CompareCommand, BadInputIsOneLine) {
  const testing::TempFolder folder;
  const std::string a = folder.path() / "a";
  testing::WriteReportRun(a);
  const std::string page = folder.path() / "page.html";
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{a},
                                             {a, folder.path() / "nowhere"},
                                             {a, a, "--signals", "objct/*"},
                                             {a, a, "--tolerance", "-1"},
                                             {a, a, "--tolerance", "nan"},
                                             {a, a, "--video", folder.path() / "video.txt"},
                                             {a, a, a, "--video", folder.path() / "video.gif"},
                                             {a, a, "--out", folder.path() / "page.pdf"}}) {
    std::vector<std::string> command = {"compare", "--out", page};
    if (std::find(words.begin(), words.end(), "--out") != words.end()) command = {"compare"};
    command.insert(command.end(), words.begin(), words.end());
    const ProgramResult result = RunDexcheck(command);
    EXPECT_TRUE(testing::IsRefused(result, {}));
    EXPECT_FALSE(std::filesystem::exists(page));
  }
}

}  // namespace
}  // namespace dexcheck::testing::compare_command_test
