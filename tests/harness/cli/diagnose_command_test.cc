// dexcheck diagnose and dexcheck mutate: exit codes and results as JSON.

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::diagnose_command_test {
namespace {

/// A number that is wrong in the file, and the one that repairs it.
struct Wrong {
  const char* place;
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

  /// Returns the JSON of diagnose for two files that disagree.
  [[nodiscard]] Json Diagnose(const std::string& a, const std::string& b,
                              const Words& more = std::vector<std::string>()) const {
    return RunJson(1, Words{"diagnose", a, b} + more);
  }

  /// The causes are these single numbers, and all else agrees.
  static void ExpectCauses(const Json& results, const std::vector<Wrong>& expected) {
    EXPECT_EQ(results.at("verdict"), "disagreement");
    EXPECT_TRUE(results.at("unexplained").empty()) << results.at("unexplained");
    ASSERT_EQ(results.at("causes").size(), expected.size()) << results.at("causes");
    for (size_t i = 0; i < expected.size(); ++i) {
      const Json& change = results.at("causes").at(i).at("changes").at(0);
      EXPECT_EQ(change.at("place"), expected[i].place);
      EXPECT_EQ(change.at("quantity"), expected[i].quantity);
      EXPECT_NEAR(change.at("value"), expected[i].value, 1e-9);
      EXPECT_NEAR(change.at("repair"), expected[i].repair, 1e-9);
    }
  }

  /// Writes the repaired file, which agrees with the other one.
  void ExpectRepaired(const std::string& a, const std::string& b, const std::string& repaired) {
    const ProgramResult result = Expect(1, {"diagnose", a, b, "--write", repaired});
    EXPECT_THAT(result.out, HasSubstr("\nREPAIRED: " + repaired + " agrees with "));
    Expect(0, {"consistency", repaired, b, "--samples", "20"});
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
  const Json& cause = results.at("causes").at(0);
  EXPECT_EQ(cause.at("id"), "number.mass");
  EXPECT_EQ(cause.at("places"), Json({"link panda_link3"}));
  EXPECT_EQ(cause.at("explained"), 1.0);
  EXPECT_EQ(cause.at("changes").at(0).at("unit"), "kg");
  ExpectRepaired("bad.toml", kPandaXml, "repaired.toml");
}

TEST_F(DiagnoseCommand, WhatManyJointsHaveIsOneCause) {
  std::string text = ReadText(kPandaToml);
  for (size_t at = 0; (at = text.find("damping = 0.003", at)) != std::string::npos;)
    text.replace(at, 15, "damping = 0.001");
  Write("bad.toml", text);
  const Json causes = Diagnose("bad.toml", kPandaXml).at("causes");
  ASSERT_EQ(causes.size(), 1U) << causes;
  EXPECT_EQ(causes[0].at("places").size(), 7U);
  EXPECT_EQ(causes[0].at("changes").size(), 7U);
}

TEST_F(DiagnoseCommand, JudgesPublishedNumbersByTheirDigits) {
  WritePanda("rounded.toml", {{"3.228604", "3.2286"}});
  EXPECT_EQ(RunJson(0, {"diagnose", "rounded.toml", kPandaXml}).at("verdict"), "pass");
  const Json exact = Diagnose("rounded.toml", kPandaXml, "--exact");
  EXPECT_TRUE(exact.at("causes").empty());
  EXPECT_THAT(exact.at("unexplained").at(0).get<std::string>(), HasSubstr("mass: link panda_link3"));
  EXPECT_EQ(RunJson(0, {"diagnose", "rounded.toml", kPandaXml, "--digits", "5"}).at("tolerance"), 1e-5);
  WritePanda("bad.toml", {{"3.228604", "3.2286"}, {"4.970684", "4.98"}});
  const Json bad = Diagnose("bad.toml", kPandaXml, "--tolerance 1e-5");
  ExpectCauses(bad, {{"link panda_link1", "mass", 4.98, 4.970684}});
  EXPECT_EQ(bad.at("tolerance"), 1e-5);
}

TEST_F(DiagnoseCommand, RepairsARowOfDenavitAndHartenberg) {
  WriteChanged("bad.toml", ReadText(kPandaToml), "link = \"link4\", alpha_deg = 90",
               "link = \"link4\", alpha_deg = 0");
  const Json results = Diagnose("bad.toml", kPandaXml);
  ASSERT_EQ(results.at("causes").size(), 1U) << results.at("causes");
  EXPECT_EQ(results.at("causes").at(0).at("places"), Json({"joint panda_joint4"}));
  ExpectRepaired("bad.toml", kPandaXml, "repaired.toml");
}

// Conventions that several parts share and numbers that are wrong besides are one list.
TEST_F(DiagnoseCommand, NamesConventionsAndNumbers) {
  const std::string folder = SourcePath("/harness/descriptions/examples/field_cases");
  const std::string right = ReadText(folder + "/arm.urdf");
  std::string text = ReplaceOnce(right, "xyz=\"0 0 0.3\"", "xyz=\"0 0 300\"");
  text = ReplaceOnce(text, "xyz=\"0.4 0 0\"", "xyz=\"400 0 0\"");
  Write("arm.urdf", ReplaceOnce(text, "value=\"2.1\"", "value=\"2.2\""));
  const Json results = Diagnose("arm.urdf", folder + "/arm.xml");
  EXPECT_TRUE(results.at("unexplained").empty()) << results.at("unexplained");
  const Json& causes = results.at("causes");
  ASSERT_EQ(causes.size(), 2U) << causes;
  EXPECT_EQ(causes[0].at("id"), "origin.mm");
  EXPECT_EQ(causes[0].at("places"), Json({"joint shoulder", "joint elbow"}));
  EXPECT_EQ(causes[1].at("changes").at(0).at("place"), "link upper");
  EXPECT_EQ(causes[1].at("changes").at(0).at("repair"), 2.1);
  EXPECT_NEAR(causes[0].at("explained").get<double>() + causes[1].at("explained").get<double>(), 1.0, 1e-9);
  EXPECT_GT(causes[1].at("explained"), 0.0);
  ExpectRepaired("arm.urdf", folder + "/arm.xml", "repaired.urdf");
  // Links that hang on an axis stay in place, so that no difference remains.
  text = ReplaceOnce(right, "axis xyz=\"0 1 0\"", "axis xyz=\"0 -1 0\"");
  Write("axes.urdf", ReplaceOnce(text, "axis xyz=\"1 0 0\"", "axis xyz=\"-1 0 0\""));
  const Json axes = Diagnose("axes.urdf", folder + "/arm.xml");
  EXPECT_TRUE(axes.at("unexplained").empty()) << axes.at("unexplained");
  ASSERT_EQ(axes.at("causes").size(), 1U) << axes.at("causes");
  EXPECT_EQ(axes.at("causes").at(0).at("id"), "axis.sign");
  EXPECT_EQ(axes.at("causes").at(0).at("explained"), 1.0);
}

// An MJCF keeps its other elements, and gets attributes of its own.
TEST_F(DiagnoseCommand, RepairsAnMjcf) {
  const std::string folder = SourcePath("/harness/descriptions/examples/field_cases");
  for (const char* const file : {"sign.xml", "armature.xml", "degrees.xml"}) {
    SCOPED_TRACE(file);
    ExpectRepaired(folder + "/" + file, folder + "/arm.urdf", "repaired.xml");
  }
}

TEST_F(DiagnoseCommand, WritesNothingWhereNothingCanBeRepaired) {
  const std::string folder = SourcePath("/harness/descriptions/examples/field_cases");
  const std::string arm = folder + "/arm.urdf";
  EXPECT_THAT(Expect(0, {"diagnose", arm, folder + "/arm.xml", "--write", "out.urdf"}).out,
              HasSubstr("out.urdf is not written: arm.urdf agrees with arm.xml"));
  EXPECT_THAT(Expect(1, {"diagnose", arm, folder + "/armature.xml", "--write", "out.urdf"}).out,
              HasSubstr("out.urdf is not written: arm.urdf: cannot be repaired: joint shoulder: armature"));
  EXPECT_FALSE(Has("out.urdf"));
}

// The causes are in the second file: nothing is written over the first one's right numbers, and the command
// that repairs the second one does.
TEST_F(DiagnoseCommand, CopiesNoFaultOfTheSecondFile) {
  const std::string folder = SourcePath("/harness/descriptions/examples/field_cases/");
  for (const char* const name : {"rpy_lost.xml", "about_origin.urdf", "inertials_lost.xml"}) {
    SCOPED_TRACE(name);
    const std::string b = folder + name;
    const std::string command = "dexcheck diagnose " + b + " " + folder + "arm.urdf --write FILE";
    EXPECT_THAT(Expect(1, {"diagnose", folder + "arm.urdf", b, "--write", "out.urdf"}).out,
                AllOf(HasSubstr("the cause is in " + std::string(name)), Not(HasSubstr("repair: "))));
    EXPECT_FALSE(Has("out.urdf"));
    EXPECT_THAT(RunJson(1, {"diagnose", folder + "arm.urdf", b}).at("causes").at(0).at("changes"),
                ::testing::IsEmpty());
    ExpectRepaired(b, folder + "arm.urdf", "repaired" + std::filesystem::path(name).extension().string());
  }
}

// Half a turn to both sides, beside a joint without a range, is left in the table that is repaired.
TEST_F(DiagnoseCommand, LeavesHalfATurnInATable) {
  std::string text =
      ReplaceOnce(ReadFixture("two.toml"), "[-2.0, 2.0]", "[-3.141592653589793, 3.141592653589793]");
  Write("bad.toml", ReplaceOnce(text, "mass = 1.5", "mass = 1.7"));
  WriteChanged("free.xml", ReadFixture("two.xml"), "limited=\"true\" range=\"-2 2\"", "limited=\"false\"");
  ExpectRepaired("bad.toml", "free.xml", "repaired.toml");
  EXPECT_THAT(Read("repaired.toml"), HasSubstr("-3.14159"));
}

// A frame stands in a list of its own, and is repaired there.
TEST_F(DiagnoseCommand, RepairsAFrame) {
  WriteChanged("bad.toml", ReadText(kPandaToml), "xyz = [0.0, 0.0, 0.107]", "xyz = [0.0, 0.0, 0.117]");
  const Json causes = Diagnose("bad.toml", kPandaXml).at("causes");
  ASSERT_EQ(causes.size(), 1U) << causes;
  EXPECT_EQ(causes[0].at("places"), Json({"frame panda_flange"}));
  EXPECT_EQ(causes[0].at("changes").at(0).at("place"), "frame panda_flange");
  ExpectRepaired("bad.toml", kPandaXml, "repaired.toml");
}

// Constants that a table does not state are not stated; all else is compared.
TEST_F(DiagnoseCommand, ReadsATableWithoutConstants) {
  std::string text = ReadText(kPandaToml);
  for (const char* const part : {", armature = 0.0", ",  damping = 0.003", ", damping = 0.003"}) {
    for (size_t at = 0; (at = text.find(part, at)) != std::string::npos;)
      text.erase(at, std::string(part).size());
  }
  ASSERT_EQ(text.find("armature = "), std::string::npos);
  Write("bare.toml", text);
  Expect(0, {"diagnose", "bare.toml", kPandaXml, "--ignore", "damping,armature"});
  const Json causes = Diagnose("bare.toml", kPandaXml).at("causes");
  ASSERT_EQ(causes.size(), 1U) << causes;
  EXPECT_EQ(causes[0].at("id"), "damping.missing");
}

// Names of two joints that were exchanged are one cause.
TEST_F(DiagnoseCommand, ExchangedNamesAreACause) {
  const std::string folder = SourcePath("/harness/descriptions/examples/field_cases");
  std::string text = ReadText(folder + "/arm.urdf");
  text = ReplaceOnce(text, "joint name=\"shoulder\"", "joint name=\"other\"");
  text = ReplaceOnce(text, "joint name=\"elbow\"", "joint name=\"shoulder\"");
  Write("names.urdf", ReplaceOnce(text, "joint name=\"other\"", "joint name=\"elbow\""));
  const Json causes = Diagnose("names.urdf", folder + "/arm.xml").at("causes");
  ASSERT_EQ(causes.size(), 1U) << causes;
  EXPECT_EQ(causes[0].at("id"), "exchange.joint");
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
  expect(kHopperUrdf, {"izz=\"0.01\"", "izz=\"0.015\""}, {"link leg", "inertia izz", 0.015, 0.01});
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
  const Json results = RunJson(0, "mutate two.toml two.xml");
  EXPECT_TRUE(results.at("complete").get<bool>());
  for (const auto& [kind, row] : results.at("kinds").items()) {
    EXPECT_EQ(row.at("survived"), 0) << kind;
    EXPECT_EQ(row.at("faults").get<int>(),
              row.at("found").get<int>() + row.at("refused").get<int>() + row.at("no_effect").get<int>());
  }
  // A yaw of 0.001 rad in the place of a chain that ends at once is told as another convention.
  const Json& all = results.at("kinds").at("all");
  EXPECT_GE(all.at("cause_right").get<int>(), all.at("found").get<int>() - 1);
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

// Faults in a run: the same exit codes, a table, and JSON that a program reads.
TEST_F(MutateCommand, CountsWhatIsFoundInARun) {
  // The hand does not move: what acts on velocities alone survives. It costs a fiftieth of the robot's
  // `hold`.
  const Json json = RunJson(1, "mutate hand-hold --set settle=0.2 --from 0.01 --duration 0.01 --numbers 4");
  EXPECT_EQ(json["complete"], true);
  EXPECT_GT(json["kinds"]["all"]["survived"], 0);
  EXPECT_EQ(json["kinds"]["number"]["cause_right"], 4);
  EXPECT_EQ(json["kinds"]["law, one part"]["faults"], 45);
  EXPECT_EQ(json["faults"].size(), json["kinds"]["all"]["faults"].get<size_t>());
}

// A campaign continues from the results of an interrupted one with the same options.
TEST_F(MutateCommand, GoesOnFromWhatAnInterruptedCampaignLeft) {
  const std::string command =
      "mutate hold --set settle=0.2 --from 0.01 --duration 0.01 --kinds body --draws 6 --json out.json";
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

}  // namespace
}  // namespace dexcheck::testing::diagnose_command_test
