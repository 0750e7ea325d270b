// dexcheck consistency and diagnose of two files: what only one of them has, what cannot be compared, what is
// the engine's own, and which difference comes first.

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::compare_files_test {
namespace {

class CompareFiles : public CommandTest {
 protected:
  CompareFiles() {
    Write("a.urdf", kUrdf);
    Write("b.xml", kPair);
  }

  /// The comparison must find this alone.
  void ExpectFinding(const std::string& a, const std::string& b, const std::string& check) const {
    const Json results = Compare(1, a, b);
    ASSERT_EQ(results.at("findings").size(), 1U) << a << b;
    EXPECT_EQ(results.at("findings").front().at("check"), check);
  }

  const std::string kUrdf = ReadFixture("pair.urdf");
  const std::string kPair = ReadFixture("pair.xml");
};

// An MJCF is read by the engine besides, which opens it by itself.
TEST_F(CompareFiles, ADescriptionIsOpenedOnce) {
  if (std::system("command -v strace > /dev/null 2>&1 && strace -o /dev/null true") != 0)
    GTEST_SKIP() << "strace cannot trace here";
  Write("c.urdf", kUrdf);
  for (const char* arguments :
       {"consistency a.urdf c.urdf --samples 5", "consistency a.urdf b.xml --samples 5",
        "consistency b.xml b.xml --samples 5", "diagnose a.urdf b.xml",
        "engines b.xml --engines analytic,mujoco --samples 5",
        "engines a.urdf --engines analytic,mujoco --samples 5", "audit a.urdf", "audit b.xml"}) {
    SCOPED_TRACE(arguments);
    ProgramOptions options;
    options.folder = folder_.path();
    RunProgram(Words("strace -f -e trace=openat -o trace.txt") + DexcheckCommand(arguments), options);
    const std::string trace = Read("trace.txt");
    for (const char* file : {"a.urdf", "b.xml"}) {
      size_t named = 0;
      size_t opened = 0;
      for (const std::string& word : Words(arguments)) named += word == file ? 1 : 0;
      const std::string quoted = "\"" + std::string(file) + "\"";
      for (size_t at = trace.find(quoted); at != std::string::npos; at = trace.find(quoted, at + 1)) ++opened;
      EXPECT_EQ(opened, named) << file;
    }
  }
}

TEST_F(CompareFiles, WhatOneAloneHasIsADisagreementUnlessItIsIgnored) {
  struct Addition {
    const char* attribute;
    const char* word;
    const char* check;
    double value;
    const char* effect;  // of I = 0.011 + 0.8 * 0.1^2 about the axis
  };
  for (const Addition& addition :
       {Addition{"armature=\"0.01\"", "armature", "joint_armature", 0.01, "53 %"},
        {"damping=\"0.3\"", "damping", "joint_damping", 0.3, "0.063 s"},
        {"frictionloss=\"0.1\"", "friction", "joint_dry_friction", 0.1, "5.3 rad/s^2"}}) {
    SCOPED_TRACE(addition.word);
    WriteChanged("more.xml", kPair, "range=\"-1 1\"", "range=\"-1 1\" " + std::string(addition.attribute));
    const Json results = Compare(1, "a.urdf", "more.xml");
    ASSERT_EQ(results.at("findings").size(), 1U);
    const Json& finding = results.at("findings").front();
    EXPECT_EQ(finding.at("check"), addition.check);
    EXPECT_EQ(finding.at("model"), 0.0);
    EXPECT_EQ(finding.at("engine"), addition.value);
    EXPECT_THAT(finding.at("effect"), HasSubstr(addition.effect));
    // The addition hides nothing else.
    for (const auto& [name, check] : results.at("checks").items())
      EXPECT_EQ(check.at("pass"), name != addition.check) << name;

    const Json ignored = Compare(0, "a.urdf", "more.xml", "--ignore armature,damping,friction");
    EXPECT_FALSE(ignored.at("checks").contains(addition.check));
    EXPECT_THAT(ignored.at("not_compared"), Contains(HasSubstr(addition.word)));
    // A table states all, and is judged so too.
    Expect(0, "import a.urdf --out a.toml");
    Compare(1, "a.toml", "more.xml");
    Compare(0, "a.toml", "more.xml", {"--ignore", addition.word});
    // Its repair is the diagnosis, where motion shows it.
    EXPECT_EQ(RunJson(1, "diagnose a.urdf more.xml").at("causes").size(), 1U);
    Expect(0, {"diagnose", "a.urdf", "more.xml", "--ignore", addition.word});
  }
}

TEST_F(CompareFiles, AJointThatFollowsAnotherIsADisagreementUnlessItIsIgnored) {
  WriteChanged("mimic.urdf", kUrdf, "<origin xyz=\"0.3 0 0\"/>",
               "<origin xyz=\"0.3 0 0\"/><mimic joint=\"shoulder\" multiplier=\"0.5\"/>");
  WriteChanged("tied.xml", kPair, "</worldbody>",
               "</worldbody><equality><joint joint1=\"elbow\" joint2=\"shoulder\" polycoef=\"0 0.5 0 0 "
               "0\"/></equality>");
  Compare(0, "mimic.urdf", "tied.xml");
  for (const auto& [a, b, check] : {std::tuple("mimic.urdf", "b.xml", "joint_coupling"),
                                    {"mimic.urdf", "a.urdf", "joint_coupling"},
                                    {"a.urdf", "tied.xml", "equality_constraint"}}) {
    ExpectFinding(a, b, check);
    EXPECT_THAT(Compare(0, a, b, "--ignore coupling").at("not_compared"), Contains(HasSubstr("coupling")));
  }
}

// Both ways to name two files, in both orders, are one.
TEST_F(CompareFiles, OneWayLeadsToEachResult) {
  Expect(0, "import a.urdf --out a.toml");
  const std::vector<std::string> files = {"a.urdf", "b.xml", "a.toml"};
  for (const std::string& a : files) {
    for (const std::string& b : files) {
      Json placed = Compare(0, a, b);
      Json named = RunJson(0, {"consistency", "--robot", a, "--mjcf", b, "--samples", "100"});
      for (Json* const results : {&placed, &named}) results->erase("seconds");
      EXPECT_EQ(placed, named) << a << " " << b;
    }
  }
}

// One change of a pair of files has one verdict in consistency, diagnose and a run.
TEST_F(CompareFiles, HaveOneVerdictInEachCommand) {
  Copy("pair.urdf");
  Copy("pair.xml");
  Expect(0, "init pair.urdf pair.xml --out made");
  const std::string table = Read("made/robot.toml");
  ASSERT_THAT(table, AllOf(HasSubstr("mass = 0.8"), HasSubstr("com = [0.1, 0.02, 0]")));
  const auto judge = [&](const std::string& changed) {
    Write("made/robot.toml", changed);
    const int consistency = Run("consistency made/robot.toml made/robot.xml --samples 100").exit_code;
    EXPECT_EQ(Run("diagnose made/robot.toml made/robot.xml").exit_code, consistency) << changed;
    EXPECT_EQ(Run("run made/motion.toml --set duration=0.05 --no-log").exit_code, consistency) << changed;
    return consistency;
  };
  EXPECT_EQ(judge(table), 0);
  // To the printed digits the first two are the same number.
  EXPECT_EQ(judge(ReplaceOnce(table, "mass = 0.8", "mass = 0.8004")), 0);
  EXPECT_EQ(judge(ReplaceOnce(table, "com = [0.1, 0.02, 0]", "com = [0.1002, 0.02, 0]")), 0);
  for (const Edit& edit : {Edit{"mass = 0.8", "mass = 0.81"},
                           {"com = [0.1, 0.02, 0]", "com = [0.1, 0.021, 0]"},
                           {"-1, 1], damping = 0", "-1, 1], damping = 0.1"},
                           {"xyz = [0.3, 0, 0]", "xyz = [0.3, 0.001, 0]"}})
    EXPECT_EQ(judge(ReplaceOnce(table, edit.from, edit.to)), 1) << edit.to;
}

TEST_F(CompareFiles, FramesOfLinksAreAlwaysThereToCompare) {
  Expect(0, "import a.urdf --out a.toml");
  for (const char* const a : {"a.urdf", "a.toml"}) {
    for (const char* const b : {"b.xml", "a.urdf"}) {
      const Json results = Compare(0, a, b);
      for (const char* const term : {"frame_pose", "J", "J_dot_xi"}) {
        ASSERT_TRUE(results.at("checks").contains(term)) << a << b << term;
        EXPECT_GT(results.at("checks").at(term).at("compared"), 0);
      }
    }
  }
  // A table whose bodies and sites have other names has them, too.
  Write("table.toml", ReadFixture("two.toml"));
  Write("names.xml", ReplaceOnce(ReplaceOnce(ReadFixture("two.xml"), "body name=\"lower\"", "body"),
                                 "site name=\"tip\"", "site name=\"top\""));
  EXPECT_THAT(Compare(0, "table.toml", "names.xml").at("not_compared"),
              Contains(AllOf(HasSubstr("frames"), HasSubstr("table.toml"), HasSubstr("tip"))));
  // And they are compared: a body that turns about another place.
  WriteChanged("wrong.xml", kPair, "pos=\"0.3 0 0\"", "pos=\"0.3 0.01 0.01\"");
  const Json wrong = Compare(1, "a.urdf", "wrong.xml");
  for (const char* const term : {"frame_pose", "J", "J_dot_xi"})
    EXPECT_FALSE(wrong.at("checks").at(term).at("pass")) << term;
}

// Principal moments 0.01, 0.011, 0.03: published robots have such links.
TEST_F(CompareFiles, ABodyThatNoneCanBeIsComparedAndNoted) {
  WriteChanged("a.urdf", kUrdf, "izz=\"0.012\"", "izz=\"0.03\"");
  Expect(0, "import a.urdf --out a.toml");
  WriteChanged("b.xml", ReplaceOnce(kPair, "0.01 0.011 0.012", "0.01 0.011 0.03"), "angle=\"radian\"",
               "angle=\"radian\" balanceinertia=\"true\"");
  const auto is_noted = Contains(AllOf(HasSubstr("impossible inertias"), HasSubstr("lower")));
  for (const char* const b : {"a.urdf", "a.toml"}) EXPECT_THAT(Compare(0, "a.urdf", b).at("notes"), is_noted);
  for (const char* const a : {"a.urdf", "a.toml"}) {
    const Json balanced = Compare(1, a, "b.xml");
    EXPECT_THAT(balanced.at("notes"), is_noted);
    EXPECT_FALSE(balanced.at("checks").at("link_inertia").at("pass"));
    EXPECT_THAT(balanced.at("checks").at("link_inertia").at("where"), HasSubstr("lower"));
    EXPECT_EQ(RunJson(1, {"audit", a}).at("findings").at(0).at("level"), "impossible");
  }
}

// The table's angles leave 1.1e-14 of this chain's axes.
TEST_F(CompareFiles, ATableThatWasImportedAgreesWithWhatItIsOf) {
  Write("turned.urdf", R"(<robot name="r"><link name="b"/>
<link name="l0"><inertial><mass value="0.77"/>
  <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="l1"><inertial><mass value="0.52"/>
  <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j0" type="continuous"><parent link="b"/><child link="l0"/>
  <origin xyz="0.035309 0.035495 -0.076471" rpy="-1.309278 -2.670774 -1.556142"/><axis xyz="0 0 1"/></joint>
<joint name="j1" type="continuous"><parent link="l0"/><child link="l1"/>
  <origin xyz="-0.018030 -0.011781 0.008361" rpy="2.026017 2.110552 -2.83005"/><axis xyz="0 1 0"/></joint>
</robot>)");
  Expect(0, "import turned.urdf --out turned.toml");
  const Json imported = Compare(0, "turned.urdf", "turned.toml");
  constexpr double kBound = 3.0 * 16.0 * 2.220446049250313e-16;  // of a URDF against itself, d = 2
  const Json itself = Compare(0, "turned.urdf", "turned.urdf");
  EXPECT_DOUBLE_EQ(itself.at("checks").at("joint_axis").at("bound"), kBound);
  EXPECT_GT(imported.at("checks").at("joint_axis").at("max"), kBound);
}

// Half a turn to both sides is what a table states of a joint without a range.
TEST_F(CompareFiles, HalfATurnIsNoRangeBesideATable) {
  WriteChanged("turn.toml", ReadFixture("two.toml"), "[-2.0, 2.0]",
               "[-3.141592653589793, 3.141592653589793]");
  WriteChanged("turn.xml", ReadFixture("two.xml"), "-2 2", "-3.14159 3.14159");
  WriteChanged("other.xml", ReadFixture("two.xml"), "-2 2", "-3.1 3.14159");
  Compare(0, "turn.toml", "turn.xml");
  Compare(0, "turn.xml", "turn.toml");
  EXPECT_EQ(Compare(1, "turn.toml", "other.xml").at("causes").size(), 1);
}

// A slender body, whose principal axes MuJoCo finds to 1e-8 at best.
TEST_F(CompareFiles, WhatTheEngineMakesOfFullinertiaIsItsOwn) {
  const Json results = Compare(0, "a.urdf", "b.xml");
  EXPECT_THAT(results.at("notes"), Contains(AllOf(HasSubstr("fullinertia"), HasSubstr("upper"))));
  const Json diagnosis = RunJson(0, "diagnose a.urdf b.xml");
  EXPECT_EQ(diagnosis.at("verdict"), "pass");
  EXPECT_TRUE(diagnosis.at("causes").empty());
  EXPECT_FALSE(diagnosis.at("notes").empty());
  // A number that differs is none of the engine's.
  WriteChanged("wrong.urdf", kUrdf, "ixy=\"0.001\"", "ixy=\"0.001001\"");
  EXPECT_FALSE(Compare(1, "wrong.urdf", "b.xml", "--exact").at("checks").at("link_inertia").at("pass"));
}

TEST_F(CompareFiles, ARealDifferenceIsNamed) {
  const std::string rounded = ReplaceOnce(kUrdf, "value=\"0.8\"", "value=\"0.800001\"");
  Write("rounded.urdf", rounded);
  WriteChanged("wrong.urdf", rounded, "upper=\"1\" ", "upper=\"1.5\" ");
  const auto verdict = [&](const std::string& file) {
    return Expect(1, {"consistency", file, "a.urdf", "--samples", "20", "--quiet", "--exact"}).out;
  };
  EXPECT_THAT(FirstLine(verdict("rounded.urdf")), AllOf(HasSubstr("5 digits"), Not(HasSubstr("joint"))));
  EXPECT_THAT(verdict("wrong.urdf"),
              AllOf(HasSubstr("1. joint elbow: range"), HasSubstr("1.5"), Not(HasSubstr("2. "))));
}

TEST_F(CompareFiles, PartsWithoutANameGetOne) {
  WriteChanged("nameless.urdf", kUrdf, "joint name=\"shoulder\"", "joint name=\"\"");
  WriteChanged("nameless.xml", kPair, "joint name=\"shoulder\"", "joint");
  EXPECT_THAT(Compare(0, "nameless.urdf", "nameless.xml").at("notes"),
              Contains(AllOf(HasSubstr("\"#0\""), HasSubstr("upper"))));
  Expect(0, "import nameless.urdf --out nameless.toml");
  Compare(0, "nameless.toml", "nameless.urdf");
  // A free body, too.
  WriteChanged("free.xml", kPair, "<body name=\"upper\" pos=\"0 0 0.1\">",
               "<body pos=\"0 0 1\"><freejoint/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 "
               "1\"/><body name=\"upper\" pos=\"0 0 0.1\">");
  WriteChanged("free.xml", Read("free.xml"), "  </worldbody>", "</body></worldbody>");
  WriteChanged("free.urdf", kUrdf, "<link name=\"stand\"/>",
               "<link name=\"stand\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" "
               "ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>");
  Compare(0, "free.urdf", "free.xml");
}

// 100 MB hold the program's libraries and not the engine's stack.
TEST_F(CompareFiles, WantOfMemoryIsNoInvalidModel) {
  const std::string command = "ulimit -v 100000; exec '" + ProgramPath() + "' consistency b.xml b.xml";
  const ProgramResult result = RunProgram({"/bin/bash", "-c", command}, {folder_.path()});
  EXPECT_NE(result.exit_code, 2) << result.err;
  EXPECT_THAT(result.err, Not(HasSubstr("not a valid")));
}

// Part of a robot: a gripper that one file has, a base that one welds, joints that are held.
class PartOfRobot : public CommandTest {
 protected:
  PartOfRobot() {
    Write("a.urdf", ReplaceOnce(ReadFixture("pair.urdf"), "</robot>", kGripper));
    Write("b.xml", ReadFixture("pair.xml"));
  }

  const std::string kGripper = R"(<link name="finger"><inertial><origin xyz="0.02 0 0"/><mass value="0.1"/>
<inertia ixx="1e-4" iyy="2e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="grip" type="prismatic"><parent link="lower"/><child link="finger"/><origin xyz="0.25 0 0"/>
<axis xyz="0 0 1"/><limit lower="0" upper="0.04" effort="1" velocity="1"/></joint></robot>)";
};

TEST_F(PartOfRobot, WhatOneFileLacksIsACause) {
  const Json results = Compare(1, "a.urdf", "b.xml");
  ASSERT_EQ(results.at("causes").size(), 1U) << results.at("causes");
  EXPECT_EQ(results.at("causes")[0].at("id"), "joint.unneeded");
  EXPECT_EQ(results.at("causes")[0].at("places"), Json({"joint grip"}));
  EXPECT_THAT(results.at("not_compared"), Contains(AllOf(HasSubstr("terms: "), HasSubstr("grip"))));
  // The joint is held where the other file has its mass.
  WriteChanged("welded.xml", ReadFixture("pair.xml"), "diaginertia=\"0.01 0.011 0.012\"/>",
               "diaginertia=\"0.01 0.011 0.012\"/><body pos=\"0.25 0 0\"><inertial pos=\"0.02 0 0\" "
               "mass=\"0.1\" diaginertia=\"1e-4 2e-4 2e-4\"/></body>");
  EXPECT_EQ(Compare(1, "a.urdf", "welded.xml").at("unexplained"), Json::array());
  Compare(0, "a.urdf", "welded.xml", "--lock grip");
  EXPECT_FALSE(Compare(1, "a.urdf", "welded.xml", "--lock grip=0.03").at("checks").at("link_com").at("pass"));
  EXPECT_FALSE(Compare(1, "a.urdf", "welded.xml", "--ignore finger").at("checks").at("link_mass").at("pass"));
  // A fault in the common part is found.
  WriteChanged("wrong.urdf", Read("a.urdf"), "value=\"0.8\"", "value=\"0.9\"");
  const Json wrong = Compare(1, "wrong.urdf", "b.xml").at("causes");
  ASSERT_EQ(wrong.size(), 2U) << wrong;
  EXPECT_EQ(wrong[1].at("id"), "number.mass");
  EXPECT_EQ(wrong[1].at("places"), Json({"link lower"}));
}

TEST_F(PartOfRobot, ABaseThatOneFileWeldsIsACause) {
  const std::string body =
      ReplaceOnce(ReadFixture("pair.xml"), "<body name=\"upper\" pos=\"0 0 0.1\">",
                  "<body name=\"stand\" pos=\"0 0 1\"><freejoint/><inertial pos=\"0 0 0\" mass=\"1\" "
                  "diaginertia=\"1 1 1\"/><body name=\"upper\" pos=\"0 0 0.1\">");
  const std::string floats = ReplaceOnce(body, "  </worldbody>", "</body></worldbody>");
  Write("floats.xml", floats);
  Write("welded.xml", ReplaceOnce(floats, "<freejoint/>", ""));
  const Json results = Compare(1, "welded.xml", "floats.xml");
  const Json& causes = results.at("causes");
  ASSERT_EQ(causes.size(), 1U) << causes;
  EXPECT_EQ(causes[0].at("text"), "link stand: type differs: fixed here, free in the other file");
  EXPECT_THAT(results.at("not_compared"), Contains(HasSubstr("terms: ")));
}

TEST_F(PartOfRobot, OneSubtreeIsCompared) {
  WriteChanged("wrong.urdf", Read("a.urdf"), "value=\"1.5\"", "value=\"1.6\"");
  Compare(1, "wrong.urdf", "b.xml");
  for (const char* only : {"lower", "elbow"})
    Compare(0, "wrong.urdf", "b.xml", Words{"--only", only, "--ignore", "finger"});
  Compare(0, "wrong.urdf", "b.xml", "--ignore finger --lock shoulder=0.3");
  Compare(1, "wrong.urdf", "b.xml", "--ignore finger --lock elbow=0.3");
}

TEST_F(PartOfRobot, TwoNamesOfOneJointAreMatchedByStructure) {
  WriteChanged("named.xml", Read("b.xml"), "name=\"elbow\"", "name=\"wrist\"");
  Copy("pair.urdf");
  Compare(0, "pair.urdf", "named.xml");
}

}  // namespace
}  // namespace dexcheck::testing::compare_files_test
