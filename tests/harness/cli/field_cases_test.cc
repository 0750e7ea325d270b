// The cases of harness/descriptions/examples/field_cases: each command of its table finds the mistake.

#include <regex>
#include <sstream>

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::field_cases_test {
namespace {

const std::string kFolder = SourcePath("/harness/descriptions/examples/field_cases");

struct FieldCase {
  std::string command;
  std::string pointer;  // into the JSON; empty for a line on standard error
  std::string value;
};

std::vector<FieldCase> ReadTable() {
  static const std::regex row(R"(\| `dexcheck ([^`]+)` \| (standard error|`([^`]+)`) `([^`]+)` \|)");
  std::vector<FieldCase> cases;
  std::istringstream lines(ReadText(kFolder + "/README.md"));
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_search(line, match, row)) cases.push_back({match[1], match[3], match[4]});
  }
  return cases;
}

ProgramResult RunThere(const Words& words) { return RunDexcheck(words, {.folder = kFolder}); }

TEST(FieldCases, AreFoundByTheirCommands) {
  const std::vector<FieldCase> cases = ReadTable();
  ASSERT_GE(cases.size(), 13U);
  for (const FieldCase& one : cases) {
    SCOPED_TRACE(one.command);
    const ProgramResult result = RunThere(Words(one.command) + Words("--json"));
    if (one.pointer.empty()) {
      EXPECT_TRUE(IsRefused(result, {one.value}));
      continue;
    }
    ASSERT_EQ(result.exit_code, 1) << result.err;
    EXPECT_EQ(Json::parse(result.out).at(Json::json_pointer(one.pointer)), one.value) << result.out;
  }
}

// Without its mistake each is this pair.
TEST(FieldCases, AgreeWithoutTheirMistakes) {
  const ProgramResult result = RunThere("consistency arm.urdf arm.xml --json");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Json::parse(result.out).at("outcome"), "rounding");
  EXPECT_EQ(RunThere("audit arm.urdf").exit_code, 0);
}

}  // namespace
}  // namespace dexcheck::testing::field_cases_test
