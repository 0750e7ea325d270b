// dexcheck diagnose and dexcheck mutate: exit codes and results as JSON.

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::diagnose_command_test {
namespace {

/// A number that is wrong in the file, and the one that repairs it.
struct Wrong {
  const char* part;
  const char* quantity;
  double value;
  double repair;
};

class DiagnoseCommand : public CommandTest {
 protected:
  /// Writes the Panda's table with masses as given in place of others.
  void WritePanda(const std::string& name, const std::vector<Edit>& masses) const {
    std::string text = ReadText(kPandaToml);
    for (const auto& [right, wrong] : masses) text = ReplaceOnce(text, "mass = " + right, "mass = " + wrong);
    Write(name, text);
  }

  /// What diagnose says of two files, which disagree.
  [[nodiscard]] Json Diagnose(const std::string& a, const std::string& b,
                              const Words& more = "--samples 6") const {
    return RunJson(1, Words{"diagnose", a, b} + more);
  }

  /// The causes are these single numbers, of which nothing remains when they are repaired.
  static void ExpectCauses(const Json& results, const std::vector<Wrong>& expected) {
    EXPECT_EQ(results.at("verdict"), "disagreement");
    EXPECT_TRUE(results.at("remaining").empty()) << results.at("remaining");
    ASSERT_EQ(results.at("causes").size(), expected.size()) << results.at("causes");
    for (size_t i = 0; i < expected.size(); ++i) {
      const Json& change = results.at("causes").at(i).at("changes").at(0);
      EXPECT_EQ(change.at("part"), expected[i].part);
      EXPECT_EQ(change.at("quantity"), expected[i].quantity);
      EXPECT_EQ(change.at("value"), expected[i].value);
      EXPECT_EQ(change.at("repair"), expected[i].repair);
    }
  }
};

TEST_F(DiagnoseCommand, ShippedRobotHasNothingToExplain) {
  const Json results = RunJson(0, "diagnose");
  EXPECT_EQ(results.at("verdict"), "pass");
  EXPECT_TRUE(results.at("causes").empty());
}

TEST_F(DiagnoseCommand, NamesTheCauseWithItsRepair) {
  WritePanda("bad.toml", {{"3.228604", "3.3"}});
  const Json results = Diagnose("bad.toml", kPandaXml);
  ExpectCauses(results, {{"link panda_link3", "mass", 3.3, 3.228604}});
  EXPECT_NEAR(results.at("explained"), 1.0, 1e-9);
  EXPECT_EQ(results.at("causes").at(0).at("changes").at(0).at("unit"), "kg");
}

// As a published humanoid has it: the joint of its base takes what was meant for the motors' joints.
TEST_F(DiagnoseCommand, TellsWhatActsOnTheJointOfAFloatingBase) {
  const std::string inertial =
      "<inertial><origin xyz='0.1 0 0'/><mass value='2'/>"
      "<inertia ixx='0.01' iyy='0.02' izz='0.02' ixy='0' ixz='0' iyz='0'/></inertial>";
  Write("robot.urdf",
        "<robot name='robot'><link name='base'>" + inertial + "</link><link name='leg'>" + inertial +
            "</link><joint name='hip' type='revolute'><parent link='base'/><child link='leg'/>"
            "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint></robot>");
  Write("robot.xml", R"(<mujoco><compiler angle="radian"/>
  <default><joint damping="0.001" armature="0.01" frictionloss="0.1"/></default>
  <worldbody><body name="base"><joint type="free"/>
    <inertial pos="0.1 0 0" mass="2" diaginertia="0.01 0.02 0.02"/>
    <body name="leg"><joint name="hip" axis="0 1 0" limited="true" range="-1 1"/>
      <inertial pos="0.1 0 0" mass="2.5" diaginertia="0.01 0.02 0.02"/></body></body></worldbody></mujoco>)");
  const Json results = Diagnose("robot.urdf", "robot.xml", "--ignore armature,damping,friction");
  EXPECT_TRUE(results.at("remaining").empty());
  const Json& causes = results.at("causes");
  ASSERT_EQ(causes.size(), 4U) << causes;
  EXPECT_EQ(causes[0].at("changes").at(0).at("part"), "link leg");
  EXPECT_EQ(causes[0].at("changes").at(0).at("repair"), 2.5);
  const std::pair<const char*, const char*> only_there[] = {
      {"damping", "0.001"}, {"armature", "0.01"}, {"dry friction", "0.1"}};
  for (size_t i = 0; i < 3; ++i) {
    const std::string text = causes[i + 1].at("text");
    for (const char* part : {"link base", only_there[i].first, only_there[i].second, "<freejoint>"})
      EXPECT_THAT(text, HasSubstr(part));
  }
}

// Numbers that were rounded stand behind those that are wrong, in one line.
TEST_F(DiagnoseCommand, RoundedNumbersAreLast) {
  WritePanda("bad.toml",
             {{"3.228604", "3.2286"}, {"3.587895", "3.5879"}, {"1.225946", "1.2259"}, {"4.970684", "5.2"}});
  const Json causes = Diagnose("bad.toml", kPandaXml).at("causes");
  ASSERT_EQ(causes.size(), 4U);
  EXPECT_EQ(causes[0].at("changes").at(0).at("repair"), 4.970684);
  const ProgramResult result = Expect(1, {"diagnose", "bad.toml", kPandaXml, "--quiet"});
  EXPECT_THAT(result.out, HasSubstr("--digits 4"));
  EXPECT_THAT(result.out, Not(HasSubstr("\n2. ")));
}

TEST_F(DiagnoseCommand, WhatManyJointsLackIsOneLine) {
  std::string text = ReadText(kPandaToml);
  for (size_t at = 0; (at = text.find("damping = 0.003", at)) != std::string::npos;)
    text.replace(at, 15, "damping = 0.001");
  Write("bad.toml", text);
  EXPECT_EQ(Diagnose("bad.toml", kPandaXml).at("causes").size(), 7U);
  const std::string out = Expect(1, {"diagnose", "bad.toml", kPandaXml, "--quiet"}).out;
  EXPECT_THAT(out, AllOf(HasSubstr("and so at 6 more (joint "), HasSubstr("Together: 100 %.")));
  EXPECT_THAT(out, Not(HasSubstr("\n2. ")));
}

TEST_F(DiagnoseCommand, JudgesPublishedNumbersByTheirDigits) {
  WritePanda("rounded.toml", {{"3.228604", "3.2286"}});
  EXPECT_EQ(RunJson(0, {"diagnose", "rounded.toml", kPandaXml}).at("verdict"), "pass");
  ExpectCauses(Diagnose("rounded.toml", kPandaXml, "--exact"),
               {{"link panda_link3", "mass", 3.2286, 3.228604}});
  EXPECT_EQ(RunJson(0, {"diagnose", "rounded.toml", kPandaXml, "--digits", "5"}).at("tolerance"), 1e-5);
  WritePanda("bad.toml", {{"3.228604", "3.2286"}, {"4.970684", "4.98"}});
  const Json bad = Diagnose("bad.toml", kPandaXml, "--tolerance 1e-5");
  ExpectCauses(bad, {{"link panda_link1", "mass", 4.98, 4.970684}});
  EXPECT_EQ(bad.at("tolerance"), 1e-5);
}

TEST_F(DiagnoseCommand, ListsRepairsThatDoAsWell) {
  WriteChanged("bad.toml", ReadText(kPandaToml), "link = \"link4\", alpha_deg = 90",
               "link = \"link4\", alpha_deg = 0");
  const Json results = Diagnose("bad.toml", kPandaXml);
  ExpectCauses(results, {{"joint panda_joint4", "alpha", 0.0, 90.0}});
  EXPECT_EQ(results.at("causes").at(0).at("equivalents").at(0).at("what"), "joint panda_joint4: roll");
}

// One list: conventions that several parts share, then the numbers that are wrong besides.
TEST_F(DiagnoseCommand, NamesConventionsThenNumbers) {
  const std::string folder = SourcePath("/harness/descriptions/examples/field_cases");
  const std::string right = ReadText(folder + "/arm.urdf");
  std::string text = ReplaceOnce(right, "xyz=\"0 0 0.3\"", "xyz=\"0 0 300\"");
  text = ReplaceOnce(text, "xyz=\"0.4 0 0\"", "xyz=\"400 0 0\"");
  Write("arm.urdf", ReplaceOnce(text, "value=\"2.1\"", "value=\"2.2\""));
  const Json results = Diagnose("arm.urdf", folder + "/arm.xml");
  EXPECT_TRUE(results.at("remaining").empty()) << results.at("remaining");
  const Json& causes = results.at("causes");
  ASSERT_EQ(causes.size(), 2U) << causes;
  EXPECT_EQ(causes[0].at("ids"), Json({"origin.mm"}));
  EXPECT_EQ(causes[0].at("parts"), Json({"shoulder", "elbow"}));
  EXPECT_EQ(causes[1].at("changes").at(0).at("part"), "link upper");
  EXPECT_EQ(causes[1].at("changes").at(0).at("repair"), 2.1);
  EXPECT_NEAR(causes[0].at("explained").get<double>() + causes[1].at("explained").get<double>(), 1.0, 1e-9);
  EXPECT_GT(causes[1].at("explained"), 0.0);
  // What hangs on an axis stays where it is, so that nothing is left.
  text = ReplaceOnce(right, "axis xyz=\"0 1 0\"", "axis xyz=\"0 -1 0\"");
  Write("axes.urdf", ReplaceOnce(text, "axis xyz=\"1 0 0\"", "axis xyz=\"-1 0 0\""));
  const Json axes = Diagnose("axes.urdf", folder + "/arm.xml");
  EXPECT_TRUE(axes.at("remaining").empty()) << axes.at("remaining");
  ASSERT_EQ(axes.at("causes").size(), 1U) << axes.at("causes");
  EXPECT_EQ(axes.at("causes").at(0).at("ids"), Json({"axis.sign"}));
  EXPECT_EQ(axes.at("causes").at(0).at("explained"), 1.0);
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

TEST_F(DiagnoseCommand, SpeaksOfAFloatingRobotInItsFilesTerms) {
  Write("hopper.xml", kHopperMjcf);
  Expect(0, "import hopper.xml --out hopper.toml");
  const std::string table = Read("hopper.toml");
  const auto expect = [&](const std::string& text, const Edit& edit, const Wrong& wrong) {
    const std::string file = text == table ? "bad.toml" : "bad.urdf";
    WriteChanged(file, text, edit.from, edit.to);
    ExpectCauses(Diagnose(file, "hopper.xml"), {wrong});
  };
  expect(table, {"com = [0.01, 0.02, -0.2]", "com = [0.04, 0.02, -0.2]"},
         {"link leg", "centre of mass x", 0.04, 0.01});
  expect(table, {"xyz = [0.1, 0.2, -0.1]", "xyz = [0.1, 0.2, -0.12]"},
         {"joint hip", "position z", -0.12, -0.1});
  expect(table, {"mass = 5", "mass = 5.2"}, {"link trunk", "mass", 5.2, 5.0});
  expect(kHopperUrdf, {"izz=\"0.01\"", "izz=\"0.015\""}, {"link leg", "Izz", 0.015, 0.01});
  expect(kHopperUrdf, {"xyz=\"0.01 0.02 0.03\"", "xyz=\"0.01 0.02 0.05\""},
         {"link trunk", "centre of mass z", 0.05, 0.03});
}

class MutateCommand : public CommandTest {
 protected:
  MutateCommand() {
    Copy("two.toml");
    Copy("two.xml");
  }
};

TEST_F(MutateCommand, AllFaultsAreFoundAndCounted) {
  const Json results = RunJson(0, "mutate --robot two.toml --mjcf two.xml");
  EXPECT_TRUE(results.at("complete").get<bool>());
  for (const auto& [kind, row] : results.at("kinds").items()) {
    EXPECT_EQ(row.at("survived"), 0) << kind;
    EXPECT_EQ(row.at("cause_right"), row.at("found")) << kind;
    EXPECT_EQ(row.at("faults").get<int>(),
              row.at("found").get<int>() + row.at("refused").get<int>() + row.at("no_effect").get<int>());
  }
  EXPECT_EQ(results.at("faults").size(), results.at("kinds").at("all").at("faults").get<size_t>());
  EXPECT_GT(results.at("faults").size(), 80U);
  // The two axes are at right angles and the links symmetric: M is diagonal.
  const auto mirrored = [](const Json& fault) {
    return fault.at("name") == "half of the mass matrix not mirrored";
  };
  const Json& faults = results.at("faults");
  const auto found = std::ranges::find_if(faults, mirrored);
  ASSERT_NE(found, faults.end());
  EXPECT_EQ(found->at("outcome"), "no effect");
}

TEST_F(MutateCommand, DisagreeingModelsAreNotMutated) {
  WriteChanged("two.toml", Read("two.toml"), "mass = 1.5", "mass = 1.6");
  EXPECT_TRUE(Refused("mutate --robot two.toml --mjcf two.xml", {"two.toml", "must agree with two.xml"}));
}

// Faults in a run: the same exit codes, a table, and JSON that a program reads.
TEST_F(MutateCommand, CountsWhatIsFoundInARun) {
  // The hand does not move: what acts on velocities alone survives. It costs a fiftieth of the robot's
  // `hold`.
  const Json json =
      RunJson(1, "mutate --run hand-hold --set settle=0.2 --from 0.01 --duration 0.01 --numbers 4");
  EXPECT_EQ(json["complete"], true);
  EXPECT_GT(json["kinds"]["all"]["survived"], 0);
  EXPECT_EQ(json["kinds"]["number"]["cause_right"], 4);
  EXPECT_EQ(json["kinds"]["law, one part"]["faults"], 45);
  EXPECT_EQ(json["faults"].size(), json["kinds"]["all"]["faults"].get<size_t>());
}

// What an interrupted campaign left is taken, by one that was asked for the same.
TEST_F(MutateCommand, GoesOnFromWhatAnInterruptedCampaignLeft) {
  const std::string command =
      "mutate --run hold --set settle=0.2 --from 0.01 --duration 0.01 --kinds body --draws 6 --json out.json";
  ASSERT_LE(Run(command).exit_code, 1);
  const Json whole = Json::parse(Read("out.json"));
  Json part = whole;
  part["complete"] = false;
  part["faults"].erase(part["faults"].begin() + 3, part["faults"].end());
  part["faults"][0]["remark"] = "taken";
  Write("out.json", part.dump());
  EXPECT_THAT(Run(command).err, HasSubstr("3 of 6 faults"));
  Json again = Json::parse(Read("out.json"));
  EXPECT_EQ(again["faults"][0]["remark"], "taken");
  again["faults"][0]["remark"] = whole["faults"][0]["remark"];
  EXPECT_EQ(again, whole);
  // Asked for something else it begins anew.
  Write("out.json", part.dump());
  ASSERT_LE(Run(command + " --draw-seed 2").exit_code, 1);
  EXPECT_NE(Json::parse(Read("out.json"))["faults"][0]["remark"], "taken");
}

TEST_F(MutateCommand, NamesAKindOfFaultThatThereIsNot) {
  EXPECT_TRUE(Refused("mutate --run hold --set settle=0.2 --from 0.01 --kinds motor,wings --draws 1",
                      {"--kinds", "\"wings\""}));
}

}  // namespace
}  // namespace dexcheck::testing::diagnose_command_test
