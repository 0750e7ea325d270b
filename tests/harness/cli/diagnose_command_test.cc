// dexcheck diagnose and dexcheck mutate: exit codes, text, results as JSON, interruption.

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::diagnose_command_test {
namespace {

using Json = nlohmann::json;

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

// As a published humanoid has it: the joint of its base takes what was meant for the motors' joints.
TEST(DiagnoseCommand, TellsWhatActsOnTheJointOfAFloatingBase) {
  const TempFolder folder;
  const std::string inertial =
      "<inertial><origin xyz='0.1 0 0'/><mass value='2'/>"
      "<inertia ixx='0.01' iyy='0.02' izz='0.02' ixy='0' ixz='0' iyz='0'/></inertial>";
  WriteText(folder.path() / "robot.urdf",
            "<robot name='robot'><link name='base'>" + inertial + "</link><link name='leg'>" + inertial +
                "</link><joint name='hip' type='revolute'><parent link='base'/><child link='leg'/>"
                "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint></robot>");
  WriteText(folder.path() / "robot.xml", R"(<mujoco><compiler angle="radian"/>
  <default><joint damping="0.001" armature="0.01" frictionloss="0.1"/></default>
  <worldbody><body name="base"><joint type="free"/>
    <inertial pos="0.1 0 0" mass="2" diaginertia="0.01 0.02 0.02"/>
    <body name="leg"><joint name="hip" axis="0 1 0" limited="true" range="-1 1"/>
      <inertial pos="0.1 0 0" mass="2.5" diaginertia="0.01 0.02 0.02"/></body></body></worldbody></mujoco>)");
  const ProgramResult result = RunDexcheck(
      {"diagnose", "robot.urdf", "robot.xml", "--ignore", "armature,damping,friction"}, {folder.path()});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  const std::string why =
      " only in the MJCF: the analytic model has none (<joint type=\"free\"> takes the defaults of <joint>, "
      "<freejoint> does not)\n";
  EXPECT_THAT(result.out, HasSubstr("1. link leg: mass 2 kg in robot.urdf, 2.5 kg repairs it"));
  EXPECT_THAT(result.out, HasSubstr("2. free joint of link base: damping of 0.001" + why +
                                    "3. free joint of link base: armature of 0.01" + why +
                                    "4. free joint of link base: dry friction of 0.1" + why));
  EXPECT_THAT(result.out, HasSubstr("With these repaired the two agree to rounding."));
}

// Numbers that were rounded stand behind those that are wrong.
TEST(DiagnoseCommand, RoundedNumbersAreOneLine) {
  const TempFolder folder;
  std::string text = ReadText(testing::kParameters + "panda.toml");
  for (const auto& [number, rounded] :
       {std::pair("3.228604", "3.2286"), {"3.587895", "3.5879"}, {"1.225946", "1.2259"}}) {
    text = ReplaceOnce(text, std::string("mass = ") + number, std::string("mass = ") + rounded);
  }
  WriteText(folder.path() / "bad.toml", ReplaceOnce(text, "mass = 4.970684", "mass = 5.2"));
  const ProgramResult result =
      RunDexcheck({"diagnose", "bad.toml", testing::kMjcf + "panda.xml", "--quiet", "--json", "out.json"},
                  {folder.path()});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr(": mass 5.2 kg in bad.toml, 4.970684 kg repairs it"));
  EXPECT_THAT(result.out,
              HasSubstr("\nAnd 3 that agree to 4 digits, as rounded numbers do (--digits 4 judges "
                        "by that): "));
  EXPECT_THAT(result.out, Not(HasSubstr("\n2. ")));
  EXPECT_EQ(Json::parse(ReadText(folder.path() / "out.json")).at("causes").size(), 4U);
}

TEST(DiagnoseCommand, JudgesPublishedNumbersByTheirDigits) {
  const TempFolder folder;
  std::string text = ReadText(testing::kParameters + "panda.toml");
  text = ReplaceOnce(text, "mass = 3.228604", "mass = 3.2286");
  WriteText(folder.path() / "rounded.toml", text);
  WriteText(folder.path() / "bad.toml", ReplaceOnce(text, "mass = 4.970684", "mass = 4.98"));
  const auto run = [&](const std::string& file, std::vector<std::string> more) {
    std::vector<std::string> words = {"diagnose", file, testing::kMjcf + "panda.xml", "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return RunDexcheck(words, {folder.path()});
  };
  const ProgramResult by_rounding = run("rounded.toml", {});
  EXPECT_EQ(by_rounding.exit_code, 1) << by_rounding.err;
  EXPECT_THAT(by_rounding.out, HasSubstr("mass 3.2286 kg in rounded.toml, 3.228604 kg repairs it"));
  const ProgramResult by_digits = run("rounded.toml", {"--digits", "5"});
  EXPECT_EQ(by_digits.exit_code, 0) << by_digits.err << by_digits.out;
  EXPECT_EQ(by_digits.out,
            "AGREE: nothing to explain: rounded.toml and panda.xml agree to 1e-05 at 6 random\n  states.\n");
  const ProgramResult bad = run("bad.toml", {"--tolerance", "1e-5", "--json", "out.json"});
  EXPECT_EQ(bad.exit_code, 1) << bad.err;
  EXPECT_THAT(bad.out, HasSubstr("1. link panda_link1: mass 4.98 kg in bad.toml, 4.970684 kg repairs it"));
  EXPECT_THAT(bad.out, Not(HasSubstr("panda_link3")));
  EXPECT_THAT(bad.out, HasSubstr("With it repaired the two agree to 1e-05.\n"));
  const Json results = Json::parse(ReadText(folder.path() / "out.json"));
  EXPECT_EQ(results.at("tolerance"), 1e-5);
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

// A robot whose base floats, as a table that `import` wrote and as a URDF: what is wrong is said as it stands
// in the file, though the joint's axis is not z.
constexpr const char* kHopperMjcf = R"(<mujoco model="hopper"><compiler angle="radian"/><worldbody>
<body name="trunk" pos="0 0 1"><freejoint/><inertial pos="0.01 0.02 0.03" mass="5" diaginertia="0.05 0.06 0.07"/>
<body name="leg" pos="0.1 0.2 -0.1"><joint name="hip" axis="0 1 0" limited="true" range="-1 1"/>
<inertial pos="0.01 0.02 -0.2" mass="2" diaginertia="0.02 0.03 0.01"/></body></body></worldbody></mujoco>
)";
constexpr const char* kHopperUrdf = R"(<robot name="hopper">
<link name="trunk"><inertial><origin xyz="0.01 0.02 0.03"/><mass value="5"/>
<inertia ixx="0.05" iyy="0.06" izz="0.07" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="leg"><inertial><origin xyz="0.01 0.02 -0.2"/><mass value="2"/>
<inertia ixx="0.02" iyy="0.03" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hip" type="revolute"><origin xyz="0.1 0.2 -0.1"/><parent link="trunk"/><child link="leg"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>
)";

TEST(DiagnoseCommand, SpeaksOfAFloatingRobotInItsFilesTerms) {
  const TempFolder folder;
  WriteText(folder.path() / "hopper.xml", kHopperMjcf);
  ASSERT_EQ(RunDexcheck({"import", "hopper.xml", "--out", "hopper.toml"}, {folder.path()}).exit_code, 0);
  const std::string table = ReadText(folder.path() / "hopper.toml");
  const auto expect = [&](const std::string& file, const std::string& text, const std::string& line) {
    WriteText(folder.path() / file, text);
    const ProgramResult result = RunDexcheck({"diagnose", file, "hopper.xml"}, {folder.path()});
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_EQ(result.out, "DISAGREE: " + file + " against hopper.xml.\n1. " + line +
                              "; explains 100 % of the residual\n"
                              "With it repaired the two agree to rounding.\n");
  };
  expect("bad.toml", ReplaceOnce(table, "com = [0.01, 0.02, -0.2]", "com = [0.04, 0.02, -0.2]"),
         "link leg: centre of mass x 0.04 m in bad.toml, 0.01 m repairs it");
  expect("bad.toml", ReplaceOnce(table, "xyz = [0.1, 0.2, -0.1]", "xyz = [0.1, 0.2, -0.12]"),
         "joint hip: position z -0.12 m in bad.toml, -0.1 m repairs it");
  expect("bad.toml", ReplaceOnce(table, "mass = 5", "mass = 5.2"),
         "link trunk: mass 5.2 kg in bad.toml, 5 kg repairs it");
  expect("bad.urdf", ReplaceOnce(kHopperUrdf, "izz=\"0.01\"", "izz=\"0.015\""),
         "link leg: Izz 0.015 kg m^2 in bad.urdf, 0.01 kg m^2 repairs it");
  expect("bad.urdf", ReplaceOnce(kHopperUrdf, "xyz=\"0.01 0.02 0.03\"", "xyz=\"0.01 0.02 0.05\""),
         "link trunk: centre of mass z 0.05 m in bad.urdf, 0.03 m repairs it");
  EXPECT_TRUE(IsRefused(RunDexcheck({"diagnose", "hopper.xml", "hopper.xml"}, {folder.path()}),
                        {"hopper.xml: must be a parameter file or a URDF", "dexcheck import"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"diagnose", "hopper.toml", "bad.urdf"}, {folder.path()}),
                        {"bad.urdf: must be an MJCF", "dexcheck consistency"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"diagnose", "hopper.toml"}, {folder.path()}), {"two files"}));
}

TEST(DiagnoseCommand, RefusesBadOptions) {
  EXPECT_TRUE(IsRefused(RunDexcheck({"diagnose", "--samples", "0"}), {"--samples", "0"}));
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"diagnose", "--robot", "none.toml", "--mjcf", "none.xml"}), {"none.toml"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"diagnose", "--digits", "16"}), {"--digits", "16"}));
  EXPECT_TRUE(
      IsRefused(RunDexcheck({"diagnose", "--tolerance", "2"}), {"--tolerance", "above 0 and below 1"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"diagnose", "--tolerance", "1e-3", "--digits", "3"}), {"--tolerance"}));
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

TEST_F(TwoLinks, AllFaultsAreFoundAndCounted) {
  const ProgramResult result = Run({"mutate", "--json", "out.json"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("\nALL FOUND: "));
  // The two axes are at right angles and the links symmetric: M is diagonal.
  EXPECT_THAT(result.out, HasSubstr("\nno effect: half of the mass matrix not mirrored\n"));
  const Json results = Json::parse(ReadText(folder_.path() / "out.json"));
  EXPECT_TRUE(results.at("complete").get<bool>());
  for (const auto& [kind, row] : results.at("kinds").items()) {
    EXPECT_EQ(row.at("survived"), 0) << kind;
    EXPECT_EQ(row.at("cause_right"), row.at("found")) << kind;
    EXPECT_EQ(row.at("faults").get<int>(),
              row.at("found").get<int>() + row.at("refused").get<int>() + row.at("no_effect").get<int>());
  }
  EXPECT_EQ(results.at("faults").size(), results.at("kinds").at("all").at("faults").get<size_t>());
  EXPECT_GT(results.at("faults").size(), 80U);
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
  EXPECT_THAT(result.err, ::testing::StartsWith("dexcheck: interrupted after "));
  EXPECT_THAT(result.out, HasSubstr("INTERRUPTED after "));
  EXPECT_FALSE(Json::parse(ReadText(folder.path() / "out.json")).at("complete").get<bool>());
}

// Faults in a run: the same exit codes, a table, JSON that a program reads, and what has no meaning there
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
  EXPECT_EQ(json["kinds"]["law, one part"]["faults"], 45);
  EXPECT_EQ(json["faults"].size(), json["kinds"]["all"]["faults"].get<size_t>());
}

TEST(MutateRunCommand, RefusesWhatHasNoMeaning) {
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--from", "1"}), {"--from", "--run"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--run", "hold", "--from", "-1"}), {"--from", "-1"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--run", "hold", "--samples", "5"}), {"--samples", "--run"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--run", "lift"}), {"lift.toml", "task"}));
  EXPECT_TRUE(IsRefused(RunDexcheck({"mutate", "--run", "paper-rigid"}), {"paper-rigid.toml", "plant.type"}));
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
}  // namespace dexcheck::testing::diagnose_command_test
