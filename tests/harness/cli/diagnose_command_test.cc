// dexcheck diagnose and dexcheck mutate: exit codes, text, results as JSON, interruption.

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck {
namespace {

using Json = nlohmann::json;
using testing::DexcheckCommand;
using ::testing::HasSubstr;
using testing::IsRefused;
using testing::ProgramResult;
using testing::ReadText;
using testing::ReplaceOnce;
using testing::RunDexcheck;
using testing::TempFolder;
using testing::WriteText;

TEST(DiagnoseCommand, ShippedRobotHasNothingToExplain) {
  const ProgramResult result = RunDexcheck({"diagnose"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("AGREE: nothing to explain"));
}

TEST(DiagnoseCommand, NamesTheCauseWithItsRepair) {
  const TempFolder folder;
  std::string text = ReadText(testing::kParameters + "panda.toml");
  text = ReplaceOnce(text, "mass = 3.228604", "mass = 3.3");
  WriteText(folder.path() / "bad.toml", text);
  const ProgramResult result = RunDexcheck(
      {"diagnose", "--robot", "bad.toml", "--mjcf", testing::kMjcf + "panda.xml", "--json", "out.json"},
      {folder.path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(
      result.out,
      "DISAGREE: bad.toml against panda.xml.\n"
      "1. link panda_link3: mass 3.3 kg in bad.toml, 3.228604 kg repairs it; explains 100 % of the residual\n"
      "With it repaired the two agree to rounding.\n");
  const Json results = Json::parse(ReadText(folder.path() / "out.json"));
  EXPECT_EQ(results.at("verdict"), "disagreement");
  EXPECT_NEAR(results.at("explained"), 1.0, 1e-9);
  ASSERT_EQ(results.at("causes").size(), 1U);
  const Json change = results.at("causes").front().at("changes").front();
  EXPECT_EQ(change.at("part"), "link panda_link3");
  EXPECT_EQ(change.at("quantity"), "mass");
  EXPECT_EQ(change.at("unit"), "kg");
  EXPECT_EQ(change.at("value"), 3.3);
  EXPECT_EQ(change.at("repair"), 3.228604);
  EXPECT_TRUE(results.at("remaining").empty());
}

TEST(DiagnoseCommand, ListsRepairsThatDoAsWell) {
  const TempFolder folder;
  std::string text = ReadText(testing::kParameters + "panda.toml");
  text = ReplaceOnce(text, "link = \"link4\", alpha_deg = 90", "link = \"link4\", alpha_deg = 0");
  WriteText(folder.path() / "bad.toml", text);
  const ProgramResult result = RunDexcheck(
      {"diagnose", "--robot", "bad.toml", "--mjcf", testing::kMjcf + "panda.xml"}, {folder.path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("joint panda_joint4: alpha 0 deg in bad.toml, 90 deg repairs it"));
  EXPECT_THAT(result.out, HasSubstr("or, just as well: joint panda_joint4: roll"));
}

TEST(DiagnoseCommand, RefusesBadOptions) {
  EXPECT_TRUE(IsRefused(RunDexcheck({"diagnose", "--samples", "0"}), {"--samples", "0"}));
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"diagnose", "--robot", "none.toml", "--mjcf", "none.xml"}), {"none.toml"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--scale", "2"}), {"--scale", "2"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--scale", "nan"}), {"--scale"}));
}

class TwoLinks : public ::testing::Test {
 protected:
  TwoLinks() {
    WriteText(folder_.path() / "two.toml", testing::kTwoLinksToml);
    WriteText(folder_.path() / "two.xml", testing::kTwoLinksMjcf);
  }
  ProgramResult Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--robot", "two.toml", "--mjcf", "two.xml"});
    return RunDexcheck(arguments, {folder_.path()});
  }
  TempFolder folder_;
};

TEST_F(TwoLinks, AllMutantsAreKilledAndCounted) {
  const ProgramResult result = Run({"mutate", "--json", "out.json"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("\nALL KILLED: "));
  // The two axes are at right angles and the links symmetric: M is diagonal.
  EXPECT_THAT(result.out, HasSubstr("\nno effect: half of the mass matrix not mirrored\n"));
  const Json results = Json::parse(ReadText(folder_.path() / "out.json"));
  EXPECT_TRUE(results.at("complete").get<bool>());
  int mutants = 0;
  for (const auto& [kind, row] : results.at("kinds").items()) {
    mutants += row.at("mutants").get<int>();
    EXPECT_EQ(row.at("survived"), 0) << kind;
    EXPECT_EQ(row.at("named_first"), row.at("killed")) << kind;
    EXPECT_EQ(row.at("mutants").get<int>(),
              row.at("killed").get<int>() + row.at("refused").get<int>() + row.at("no_effect").get<int>());
  }
  EXPECT_EQ(results.at("mutants").size(), static_cast<size_t>(mutants));
  EXPECT_GT(mutants, 80);
}

TEST_F(TwoLinks, DisagreeingModelsAreNotMutated) {
  std::string text = testing::kTwoLinksToml;
  text = ReplaceOnce(text, "mass = 1.5", "mass = 1.6");
  WriteText(folder_.path() / "two.toml", text);
  EXPECT_TRUE(IsRefused(Run({"mutate"}), {"two.toml", "must agree with two.xml"}));
}

TEST(MutateCommand, InterruptedEndsWithWhatWasDone) {
  const TempFolder folder;
  testing::Program program(DexcheckCommand({"mutate", "--json", "out.json"}), {folder.path()});
  for (int attempt = 0; attempt < 3000 && std::filesystem::is_empty(folder.path()); ++attempt)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("INTERRUPTED after "));
  EXPECT_FALSE(Json::parse(ReadText(folder.path() / "out.json")).at("complete").get<bool>());
}

// Mistakes in a run: the same exit codes, a table, JSON that a program reads, and what has no meaning there
// is refused.
TEST(MutateRunCommand, CountsWhatIsFoundInARun) {
  const TempFolder folder;
  const std::string file = (folder.path() / "out.json").string();
  const ProgramResult result = RunDexcheck({"mutate", "--run", "hold", "--set", "settle=0.2", "--from",
                                            "0.01", "--duration", "0.01", "--numbers", "4", "--json", file});
  // `hold` does not move: what acts on velocities alone survives.
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("SURVIVORS"));
  EXPECT_THAT(result.out, HasSubstr("law, one part"));
  const Json json = Json::parse(ReadText(file));
  EXPECT_EQ(json["complete"], true);
  EXPECT_EQ(json["kinds"]["number"]["cause_right"], 4);
  EXPECT_EQ(json["kinds"]["law, one part"]["mistakes"], 45);
  EXPECT_EQ(json["mistakes"].size(), json["kinds"]["all"]["mistakes"].get<size_t>());
}

TEST(MutateRunCommand, RefusesWhatHasNoMeaning) {
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--from", "1"}), {"--from", "--run"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--run", "hold", "--from", "-1"}), {"--from", "-1"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--run", "hold", "--samples", "5"}), {"--samples", "--run"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--run", "lift"}), {"lift.toml", "task"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--run", "nowhere"}), {"nowhere"}));
}

TEST(MutateRunCommand, InterruptedTellsWhatWasDone) {
  const TempFolder folder;
  testing::Program program(DexcheckCommand({"mutate", "--run", "hold", "--set", "settle=0.1", "--from",
                                            "0.01", "--numbers", "100000", "--json", "out.json"}),
                           {folder.path()});
  for (int attempt = 0; attempt < 3000 && std::filesystem::is_empty(folder.path()); ++attempt)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  program.Signal(SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.out, HasSubstr("INTERRUPTED"));
  EXPECT_EQ(Json::parse(ReadText(folder.path() / "out.json"))["complete"], false);
}

}  // namespace
}  // namespace dexcheck
