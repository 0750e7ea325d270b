// One robot in several physics engines. MuJoCo 3 comes from npm's registry, without which its test is
// skipped.

#include <gmock/gmock.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>

#include "harness/base/shell.h"
#include "tests/common/legged_robots.h"
#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/descriptions/panda_urdf.h"

namespace dexcheck::testing::engines_command_test {
namespace {

using Json = nlohmann::json;

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
      // What is zero on both sides says nothing; gravity has no part along x.
      if (term == "M_bar" || term == "C_bar_xi") {
        EXPECT_NE(record.at("first").get<double>(), 0.0) << both << " " << term;
      }
    }
  }
}

class EngineComparison : public ::testing::Test {
 protected:
  [[nodiscard]] ProgramResult Run(const std::vector<std::string>& arguments) const {
    std::vector<std::string> words = {"engines"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return RunDexcheck(words, {folder_.path()});
  }
  [[nodiscard]] Json RunForJson(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--json", "out.json", "--quiet"});
    const ProgramResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err << result.out;
    return Json::parse(ReadText(folder_.path() / "out.json"));
  }

  TempFolder folder_;
};

// Measured: 3e-14 of the engines, of which Bullet inverts M; 2e-7 of MuJoCo 2.2.2, which diagonalises
// inertias.
constexpr double kOfEngines = 1e-12;
constexpr double kOfCompiledInertias = 1e-6;

// As of consistency: what is ignored the engine takes over from the robot.
TEST_F(EngineComparison, WhatIsIgnoredNeedNotBeShared) {
  WriteText(folder_.path() / "robot.xml", testing::kTwoLinksMjcf);
  std::string other = ReplaceOnce(testing::kTwoLinksMjcf, "armature=\"0.02\"", "armature=\"0.05\"");
  other = ReplaceOnce(other, "damping=\"0.05\"", "damping=\"0.3\"");
  WriteText(folder_.path() / "other.xml", other);
  std::vector<std::string> words = {"robot.xml", "--mjcf",          "other.xml",       "--samples",
                                    "5",         "--engines",       "analytic,mujoco", "--quiet",
                                    "--ignore",  "armature,damping"};
  EXPECT_EQ(Run(words).exit_code, 0) << Run(words).out;
  words.back() = "armature";
  EXPECT_EQ(Run(words).exit_code, 1);
  words.resize(words.size() - 2);
  EXPECT_EQ(Run(words).exit_code, 1);
}

TEST_F(EngineComparison, FiveEnginesAgreeOnAnArm) {
  WriteText(folder_.path() / "panda.urdf", testing::MakePandaUrdf());
  const std::vector<std::string> arm = {"panda.urdf", "--samples", "20", "--engines"};
  const auto with = [&](const std::string& engines) {
    std::vector<std::string> words = arm;
    words.push_back(engines);
    return words;
  };
  ExpectAllPairsAgree(RunForJson(with("analytic,bullet,kdl,simbody")), 4, kOfEngines);
  ExpectAllPairsAgree(RunForJson(with("analytic,mujoco,bullet,kdl,simbody")), 5, kOfCompiledInertias);
}

TEST_F(EngineComparison, FourEnginesAgreeOnAFloatingBase) {
  WriteText(folder_.path() / "dog.urdf", testing::WriteLeggedUrdf("dog", testing::ListQuadruped()));
  ExpectAllPairsAgree(RunForJson({"dog.urdf", "--floating", "--samples", "10", "--engines",
                                  "analytic,mujoco,bullet,simbody"}),
                      4, kOfCompiledInertias);
  // The file may let its root float itself.
  WriteText(
      folder_.path() / "own.urdf",
      ReplaceOnce(ReadText(folder_.path() / "dog.urdf"), "<link name=\"trunk\"",
                  "<link name=\"field\"/><joint name=\"free\" type=\"floating\"><parent link=\"field\"/>"
                  "<child link=\"trunk\"/></joint><link name=\"trunk\""));
  ExpectAllPairsAgree(RunForJson({"own.urdf", "--samples", "10", "--engines", "analytic,mujoco,simbody"}), 3,
                      kOfCompiledInertias);
  const ProgramResult kdl =
      Run({"dog.urdf", "--floating", "--samples", "2", "--engines", "analytic,simbody,kdl"});
  EXPECT_EQ(kdl.exit_code, 3) << kdl.out;
  EXPECT_THAT(kdl.out, HasSubstr("not compared: kdl: "));
  EXPECT_THAT(kdl.out, HasSubstr("KDL has no base that floats"));
}

TEST_F(EngineComparison, TheTableHasEveryPair) {
  const ProgramResult result = Run({testing::SourcePath("/harness/descriptions/examples/arm.urdf"),
                                    "--samples", "5", "--engines", "analytic,bullet,kdl,simbody"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const std::string pair : {"A  analytic model\nB  Bullet", "\nC  KDL", "\nD  Simbody", " A - B ",
                                 " A - C ", " A - D ", " B - C ", " B - D ", " C - D "}) {
    EXPECT_THAT(result.out, HasSubstr(pair));
  }
  EXPECT_THAT(result.out, HasSubstr("agree in all terms that they have in common."));
}

/// A setting of one engine, made in a program of the user's own, and the words that name it.
TEST_F(EngineComparison, TheSettingThatExplainsIsNamed) {
  const std::string examples = testing::SourcePath("/harness/descriptions/examples/");
  const std::string program = ReadText(examples + "arm.py");
  const auto expect = [&](const std::string& original, const std::string& changed, const std::string& words) {
    WriteText(folder_.path() / "other.py", ReplaceOnce(program, original, changed));
    const ProgramResult result = Run({examples + "arm.urdf", "--samples", "5", "--engines", "analytic,kdl",
                                      "--engine", "other=" DEXCHECK_PYTHON " other.py"});
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_THAT(result.out, HasSubstr("analytic model, KDL 1.5.1 agree"));
    EXPECT_THAT(result.out, HasSubstr(" stands alone"));
    EXPECT_THAT(result.out, HasSubstr(words)) << result.out;
  };
  expect("-9.81", "9.81", "as with gravity upwards");
  expect("-9.81", "0.0", "as with no gravity");
  expect("-9.81", "-9.80665", "as with gravity of 9.80665");
  expect("R @ inertia @ R.T", "R @ np.diag(np.diag(inertia)) @ R.T", "as with products of inertia left out");
  expect("np.cross(omega, I @ omega))", "0 * omega)", "no setting that is known explains it");
}

/// What an MJCF adds to a URDF is named as the reason why MuJoCo stands apart.
TEST_F(EngineComparison, ArmatureOfTheMjcfIsNamed) {
  WriteText(folder_.path() / "panda.urdf", testing::MakePandaUrdf());
  const std::string mjcf = ReadText(testing::SourcePath("/mjcf/panda.xml"));
  WriteText(folder_.path() / "panda.xml", ReplaceOnce(mjcf, "armature=\"0\"", "armature=\"0.1\""));
  const ProgramResult result =
      Run({"panda.urdf", "--mjcf", "panda.xml", "--samples", "5", "--engines", "analytic,mujoco,simbody"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("as with what only panda.xml states: armature"));
}

/// Forces that only the MJCF has, and that MuJoCo counts among friction, are named.
TEST_F(EngineComparison, SpringsOfTheMjcfAreNamed) {
  WriteText(folder_.path() / "arm.xml",
            R"(<mujoco><worldbody><body name="arm"><joint name="elbow" axis="0 1 0"
stiffness="3"/><inertial mass="1" pos="0 0 0.1" diaginertia="0.01 0.02 0.025"/></body></worldbody></mujoco>)");
  const ProgramResult result = Run({"arm.xml", "--samples", "3", "--engines", "analytic,mujoco"});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("its friction has forces that no description has: joint spring of joint "
                                    "elbow"));
}

TEST_F(EngineComparison, BallJointsOnAFloatingBaseAgree) {
  WriteText(folder_.path() / "doll.xml", R"(<mujoco><worldbody><body name="trunk"><freejoint/>
<inertial mass="3" pos="0.01 0.02 0" diaginertia="0.02 0.03 0.04"/>
<body name="upper" pos="0.1 0.2 0.3"><joint name="shoulder" type="ball" damping="0.1"/>
<inertial mass="2" pos="0.1 0.02 0.03" diaginertia="0.01 0.02 0.025"/>
<body name="lower" pos="0.3 0 0.1"><joint name="elbow" axis="-1 0.5 0.25"/>
<inertial mass="1" pos="0.15 0 0.01" diaginertia="0.004 0.006 0.008"/></body></body></body></worldbody></mujoco>)");
  ExpectAllPairsAgree(RunForJson({"doll.xml", "--samples", "20", "--engines", "analytic,mujoco"}), 2,
                      kOfEngines);
}

/// What an engine refuses is named by file and link, with what to do.
TEST_F(EngineComparison, ALinkThatAnEngineRefusesIsNamed) {
  WriteText(folder_.path() / "light.urdf",
            R"(<robot name="light"><link name="foot"/><link name="leg"><inertial>
<mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="toe"/><joint name="knee" type="continuous"><parent link="foot"/><child link="leg"/></joint>
<joint name="tap" type="continuous"><parent link="leg"/><child link="toe"/></joint></robot>)");
  const ProgramResult result = Run({"light.urdf", "--engines", "analytic,mujoco"});
  EXPECT_TRUE(IsRefused(result, {"mujoco: light.urdf: ", "name = toe", "needs a mass and an inertia"}));
  EXPECT_THAT(result.err, Not(HasSubstr("/tmp/")));
  const ProgramResult bullet = Run({"light.urdf", "--engines", "analytic,bullet"});
  EXPECT_TRUE(IsRefused(bullet, {"joint tap moves no mass", "dexcheck audit"}));
}

TEST_F(EngineComparison, BadInputIsRefused) {
  const std::string arm = testing::SourcePath("/harness/descriptions/examples/arm.urdf");
  EXPECT_TRUE(
      IsRefused(Run({arm, "--engines", "kdl,gazebo"}),
                {"--engines: must be of analytic, mujoco, mujoco3, bullet, kdl, simbody, got \"gazebo\""}));
  EXPECT_TRUE(IsRefused(Run({arm, "--engine", "mine"}), {"--engine: must be NAME=COMMAND, got \"mine\""}));
  EXPECT_TRUE(
      IsRefused(Run({arm, "--engines", "kdl"}), {"engine_comparison: two engines must be there, got 1"}));
  EXPECT_TRUE(IsRefused(Run({"none.urdf"}), {"none.urdf"}));
  const ProgramResult table =
      Run({testing::SourcePath("/controller/parameters/panda.toml"), "--engines", "analytic,kdl,mujoco"});
  EXPECT_TRUE(IsRefused(table, {"kdl: reads a URDF only", "--mjcf names what it reads instead"}));
}

/// MuJoCo 3 of npm, installed once for all builds' tests.
TEST_F(EngineComparison, MujocoThreeAgrees) {
  const std::filesystem::path node = DEXCHECK_NODE_FOLDER;
  if (!std::filesystem::exists(node / "node_modules/@mujoco/mujoco")) {
    const std::string install = "timeout 120 npm install --no-audit --no-fund --prefix " +
                                QuoteForShell(node.string()) + " @mujoco/mujoco@3.14.0 >/dev/null 2>&1";
    if (std::system(install.c_str()) != 0) GTEST_SKIP() << "npm cannot install @mujoco/mujoco";
  }
  WriteText(folder_.path() / "panda.urdf", testing::MakePandaUrdf());
  ExpectAllPairsAgree(RunForJson({"panda.urdf", "--samples", "20", "--node-modules", node.string(),
                                  "--engines", "analytic,mujoco3,bullet,kdl,simbody"}),
                      5, kOfEngines);
  // Both read the MJCF.
  const std::string mjcf = testing::SourcePath("/mjcf/panda.xml");
  const Json json = RunForJson({mjcf, "--samples", "20", "--node-modules", node.string()});
  EXPECT_THAT(json.at("engines").dump(), HasSubstr("MuJoCo 3."));
  ExpectAllPairsAgree(json, 3, kOfEngines);
  WriteText(folder_.path() / "dog.urdf", testing::WriteLeggedUrdf("dog", testing::ListQuadruped()));
  ExpectAllPairsAgree(RunForJson({"dog.urdf", "--floating", "--samples", "10", "--node-modules",
                                  node.string(), "--engines", "analytic,mujoco,mujoco3,bullet,simbody"}),
                      5, kOfCompiledInertias);
}

}  // namespace
}  // namespace dexcheck::testing::engines_command_test
