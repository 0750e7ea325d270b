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
  ASSERT_GE(cases.size(), 14U);
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
  const ProgramResult table = RunThere("consistency cad.csv arm.urdf --json");
  EXPECT_EQ(table.exit_code, 0) << table.err << table.out;
  EXPECT_EQ(Json::parse(table.out).at("outcome"), "digits");
}

class BodyTable : public CommandTest {
 protected:
  BodyTable() { Write("arm.urdf", ReadText(kFolder + "/arm.urdf")); }
  const std::string kTable = ReadText(kFolder + "/cad.csv");
};

// The table has the same tensors about the links' origins, in SI, between semicolons; another file is no
// table.
TEST_F(BodyTable, UnitsAndReferenceAreThoseOfItsHeader) {
  Write("si.csv",
        "# inertia: origin\nLink;Mass (kg);X (m);Y;Z;Lxx (kg m2);Lyy;Lzz;Lxy;Lxz;Lyz\n"
        "tool;0.45;0.02;0.01;0.06;0.002765;0.0027;0.000825;-0.00009;-0.00054;-0.00027\n");
  const Json results = RunJson(0, "consistency arm.urdf si.csv");
  EXPECT_THAT(results.at("notes"), Contains(HasSubstr("masses, centres of mass and inertias alone")));
  WriteChanged("wrong.csv", Read("si.csv"), "0.002765", "0.003765");
  EXPECT_EQ(RunJson(1, "consistency arm.urdf wrong.csv").at("/digits/exceeds/0/where"_json_pointer),
            "link lower");
  WriteChanged("com.csv", Read("si.csv"), "origin", "com");
  EXPECT_EQ(RunJson(1, "consistency arm.urdf com.csv").at("/digits/exceeds/0/check"_json_pointer),
            "link_inertia");
}

TEST_F(BodyTable, WhatIsNoneIsRefused) {
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& problem) {
    WriteChanged("bad.csv", kTable, from, to);
    EXPECT_TRUE(IsRefused(Run("consistency arm.urdf bad.csv"), {problem})) << from;
  };
  refused("2100", "heavy", "bad.csv:4: mass: must be a number, got \"heavy\"");
  refused("[g]", "[stone]", "bad.csv:3: mass: has no known unit: \"stone\"");
  refused("iyz", "", "bad.csv:3: header: lacks column iyz");
  refused("# inertia: com", "# inertia: middle", "bad.csv:2: inertia: must be origin or com");
  Write("other.csv", "link,mass,x,y,z,ixx,iyy,izz,ixy,ixz,iyz\nuper,1,0,0,0,1,1,1,0,0,0\n");
  EXPECT_TRUE(IsRefused(Run("consistency arm.urdf other.csv"), {"has no link of arm.urdf", "did you mean"}));
  Write("cad.csv", kTable);
  EXPECT_TRUE(IsRefused(Run("audit cad.csv"), {"is a table of bodies"}));
}

}  // namespace
}  // namespace dexcheck::testing::field_cases_test
