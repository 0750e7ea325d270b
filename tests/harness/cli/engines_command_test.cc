// One robot in several physics engines. MuJoCo 3 comes from npm's registry, without which its test is
// skipped.

#include <cstdlib>

#include "harness/base/console.h"
#include "tests/common/legged_robots.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/descriptions/panda_urdf.h"

namespace dexcheck::testing::engines_command_test {
namespace {

/// Pairs whose terms were all compared and agree, of this many engines.
void ExpectAllPairsAgree(const Json& json, size_t engines, double tolerance) {
  EXPECT_EQ(json.at("verdict"), "pass");
  ASSERT_EQ(json.at("engines").size(), engines) << json.at("absent");
  EXPECT_EQ(json.at("pairs").size(), engines * (engines - 1) / 2);
  for (const Json& pair : json.at("pairs")) {
    const std::string both =
        pair.at("first").get<std::string>() + " - " + pair.at("second").get<std::string>();
    for (const std::string term : {"M_bar", "C_bar_xi", "gravity", "bias"}) {
      ASSERT_TRUE(pair.at("terms").contains(term)) << both;
      const Json& record = pair.at("terms").at(term);
      EXPECT_LE(record.at("max").get<double>(), tolerance)
          << both << " " << term << " " << record.at("where");
      EXPECT_GT(record.at("compared").get<long>(), 100) << both;
      // A zero on both sides proves nothing; gravity has no part along x.
      if (term == "M_bar" || term == "C_bar_xi") {
        EXPECT_NE(record.at("first").get<double>(), 0.0) << both << " " << term;
      }
    }
  }
}

class EngineComparison : public CommandTest {
 protected:
  [[nodiscard]] Json Compare(int exit_code, const Words& arguments) const {
    return RunJson(exit_code, Words("engines") + arguments);
  }
  /// One of the listed settings explains an engine that stands apart.
  static void ExpectSetting(const Json& json, const std::vector<std::string>& parts) {
    for (const std::string& part : parts) EXPECT_THAT(json.at("settings").dump(), HasSubstr(part));
  }
};

// Measured: 3e-14 of the engines, of which Bullet inverts M; 2e-7 of MuJoCo 2.2.2, which diagonalises
// inertias.
constexpr double kOfEngines = 1e-12;
constexpr double kOfCompiledInertias = 1e-6;

// The engine takes ignored constants over from the robot, as in consistency.
TEST_F(EngineComparison, WhatIsIgnoredNeedNotBeShared) {
  Copy("two.xml");
  Write("other.xml", ApplyEdits(Read("two.xml"), {{"armature=\"0.02\"", "armature=\"0.05\""},
                                                  {"damping=\"0.05\"", "damping=\"0.3\""}}));
  const Words words = "engines two.xml --mjcf other.xml --samples 5 --engines analytic,mujoco";
  Expect(0, words + "--ignore armature,damping");
  Expect(1, words + "--ignore armature");
  Expect(1, words);
}

TEST_F(EngineComparison, FiveEnginesAgreeOnAnArm) {
  Write("panda.urdf", MakePandaUrdf());
  ExpectAllPairsAgree(Compare(0, "panda.urdf --samples 20 --engines analytic,bullet,kdl,simbody"), 4,
                      kOfEngines);
  ExpectAllPairsAgree(Compare(0, "panda.urdf --samples 20 --engines analytic,mujoco,bullet,kdl,simbody"), 5,
                      kOfCompiledInertias);
}

TEST_F(EngineComparison, FourEnginesAgreeOnAFloatingBase) {
  Write("dog.urdf", WriteLeggedUrdf("dog", ListQuadruped()));
  ExpectAllPairsAgree(Compare(0, "dog.urdf --floating --samples 10 --engines analytic,mujoco,bullet,simbody"),
                      4, kOfCompiledInertias);
  // The file may let its root float itself.
  WriteChanged("own.urdf", Read("dog.urdf"), "<link name=\"trunk\"",
               "<link name=\"field\"/><joint name=\"free\" type=\"floating\"><parent link=\"field\"/>"
               "<child link=\"trunk\"/></joint><link name=\"trunk\"");
  ExpectAllPairsAgree(Compare(0, "own.urdf --samples 10 --engines analytic,mujoco,simbody"), 3,
                      kOfCompiledInertias);
  const Json without = Compare(3, "dog.urdf --floating --samples 2 --engines analytic,simbody,kdl");
  ASSERT_EQ(without.at("absent").size(), 1U);
  EXPECT_THAT(without.at("absent").at(0), AllOf(HasSubstr("kdl"), HasSubstr("float")));
}

/// A setting of one engine, made in a program of the user's own, and the words that name it.
TEST_F(EngineComparison, TheSettingThatExplainsIsNamed) {
  const std::string examples = SourcePath("/harness/descriptions/examples/");
  const std::string program = ReadText(examples + "arm.py");
  const auto expect = [&](const Edit& edit, const std::string& words) {
    WriteChanged("other.py", program, edit.from, edit.to);
    const Json json = Compare(1, {examples + "arm.urdf", "--samples", "5", "--engines", "analytic,kdl",
                                  "--engine", "other=" DEXCHECK_PYTHON " other.py"});
    ASSERT_EQ(json.at("groups").size(), 2U);
    EXPECT_EQ(json.at("groups").at(0).size() + json.at("groups").at(1).size(), 3U);
    ExpectSetting(json, {words});
  };
  expect({"-9.81", "9.81"}, "gravity upwards");
  expect({"-9.81", "0.0"}, "no gravity");
  expect({"-9.81", "-9.80665"}, "9.80665");
  expect({"R @ inertia @ R.T", "R @ np.diag(np.diag(inertia)) @ R.T"}, "products of inertia");
  expect({"np.cross(omega, I @ omega))", "0 * omega)"}, "no setting");
}

/// Additions of an MJCF to a URDF are named as the reason why MuJoCo stands apart.
TEST_F(EngineComparison, ArmatureOfTheMjcfIsNamed) {
  Write("panda.urdf", MakePandaUrdf());
  WriteChanged("panda.xml", ReadText(kPandaXml), "armature=\"0\"", "armature=\"0.1\"");
  ExpectSetting(Compare(1, "panda.urdf --mjcf panda.xml --samples 5 --engines analytic,mujoco,simbody"),
                {"panda.xml", "armature"});
}

/// Forces that only the MJCF has, and that MuJoCo counts among friction, are named.
TEST_F(EngineComparison, SpringsOfTheMjcfAreNamed) {
  Write("arm.xml", R"(<mujoco><worldbody><body name="arm"><joint name="elbow" axis="0 1 0"
stiffness="3"/><inertial mass="1" pos="0 0 0.1" diaginertia="0.01 0.02 0.025"/></body></worldbody></mujoco>)");
  ExpectSetting(Compare(1, "arm.xml --samples 3 --engines analytic,mujoco"),
                {"friction", "spring", "joint elbow"});
}

TEST_F(EngineComparison, BallJointsOnAFloatingBaseAgree) {
  Write("doll.xml", R"(<mujoco><worldbody><body name="trunk"><freejoint/>
<inertial mass="3" pos="0.01 0.02 0" diaginertia="0.02 0.03 0.04"/>
<body name="upper" pos="0.1 0.2 0.3"><joint name="shoulder" type="ball" damping="0.1"/>
<inertial mass="2" pos="0.1 0.02 0.03" diaginertia="0.01 0.02 0.025"/>
<body name="lower" pos="0.3 0 0.1"><joint name="elbow" axis="-1 0.5 0.25"/>
<inertial mass="1" pos="0.15 0 0.01" diaginertia="0.004 0.006 0.008"/></body></body></body></worldbody></mujoco>)");
  ExpectAllPairsAgree(Compare(0, "doll.xml --samples 20 --engines analytic,mujoco"), 2, kOfEngines);
}

/// A refusal of an engine is named by file and link, with a remedy.
TEST_F(EngineComparison, ALinkThatAnEngineRefusesIsNamed) {
  Write("light.urdf",
        R"(<robot name="light"><link name="foot"/><link name="leg"><inertial>
<mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="toe"/><joint name="knee" type="continuous"><parent link="foot"/><child link="leg"/></joint>
<joint name="tap" type="continuous"><parent link="leg"/><child link="toe"/></joint></robot>)");
  const ProgramResult result = Run("engines light.urdf --engines analytic,mujoco");
  EXPECT_TRUE(IsRefused(result, {"mujoco: light.urdf: ", "toe", "mass", "inertia"}));
  EXPECT_THAT(result.err, Not(HasSubstr("/tmp/")));
  EXPECT_TRUE(
      Refused("engines light.urdf --engines analytic,bullet", {"joint tap", "mass", "dexcheck audit"}));
  EXPECT_TRUE(
      Refused({"engines", kPandaToml, "--engines", "analytic,kdl,mujoco"}, {"kdl", "URDF", "--mjcf"}));
}

/// MuJoCo 3 of npm, installed once for all builds' tests.
TEST_F(EngineComparison, MujocoThreeAgrees) {
  const std::filesystem::path node = DEXCHECK_NODE_FOLDER;
  if (!std::filesystem::exists(node / "node_modules/@mujoco/mujoco")) {
    const std::string install = "timeout 120 npm install --no-audit --no-fund --prefix " +
                                QuoteForShell(node.string()) + " @mujoco/mujoco@3.14.0 >/dev/null 2>&1";
    if (std::system(install.c_str()) != 0) GTEST_SKIP() << "npm cannot install @mujoco/mujoco";
  }
  const Words installed = {"--node-modules", node.string()};
  Write("panda.urdf", MakePandaUrdf());
  ExpectAllPairsAgree(
      Compare(0, Words("panda.urdf --samples 20 --engines analytic,mujoco3,bullet,kdl,simbody") + installed),
      5, kOfEngines);
  // Both read the MJCF.
  const Json json = Compare(0, Words{kPandaXml, "--samples", "20"} + installed);
  EXPECT_THAT(json.at("engines").dump(), HasSubstr("MuJoCo 3."));
  ExpectAllPairsAgree(json, 3, kOfEngines);
  Write("dog.urdf", WriteLeggedUrdf("dog", ListQuadruped()));
  ExpectAllPairsAgree(
      Compare(0, Words("dog.urdf --floating --samples 10 --engines analytic,mujoco,mujoco3,bullet,simbody") +
                     installed),
      5, kOfCompiledInertias);
}

}  // namespace
}  // namespace dexcheck::testing::engines_command_test
