// dexcheck import, and dexcheck consistency between two descriptions of any kind.

#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/descriptions/panda_urdf.h"

namespace dexcheck::testing::import_command_test {
namespace {

using Json = nlohmann::json;

class TwoDescriptions : public ::testing::Test {
 protected:
  TwoDescriptions() { WriteText(folder_.path() / "panda.urdf", testing::MakePandaUrdf()); }

  [[nodiscard]] ProgramResult Run(const std::vector<std::string>& arguments) const {
    return RunDexcheck(arguments, {folder_.path()});
  }

  TempFolder folder_;
  std::string mjcf_ = testing::kMjcf + "panda.xml";
  std::string table_ = testing::kParameters + "panda.toml";
};

TEST_F(TwoDescriptions, AgreeInEveryPairing) {
  for (const std::string& a : {std::string("panda.urdf"), mjcf_, table_}) {
    for (const std::string& b : {std::string("panda.urdf"), mjcf_, table_}) {
      const ProgramResult result = Run({"consistency", a, b, "--samples", "20"});
      EXPECT_EQ(result.exit_code, 0) << a << " " << b << result.err << result.out;
      EXPECT_THAT(result.out, HasSubstr("\nAGREE: "));
    }
  }
}

TEST_F(TwoDescriptions, ReportWhatOneLacksAndWhatDiffers) {
  WriteText(folder_.path() / "motors.xml",
            ReplaceOnce(ReadText(mjcf_), "armature=\"0\"", "armature=\"0.1\""));
  const ProgramResult lacks =
      Run({"consistency", "panda.urdf", "motors.xml", "--samples", "20", "--json", "out.json"});
  EXPECT_EQ(lacks.exit_code, 1);
  const Json results = Json::parse(ReadText(folder_.path() / "out.json"));
  EXPECT_EQ(results.at("verdict"), "disagreement");
  EXPECT_EQ(results.at("findings").size(), 7U);
  for (const Json& finding : results.at("findings")) EXPECT_EQ(finding.at("check"), "joint_armature");
  EXPECT_THAT(results.at("not_compared").dump(), HasSubstr("gravity: only motors.xml states it"));

  WriteText(folder_.path() / "wrong.urdf",
            ReplaceOnce(testing::MakePandaUrdf(), "<mass value=\"3.228604\"/>", "<mass value=\"3.3\"/>"));
  const ProgramResult against_engine = Run({"consistency", "wrong.urdf", mjcf_, "--samples", "20"});
  EXPECT_EQ(against_engine.exit_code, 1);
  EXPECT_THAT(against_engine.out,
              HasSubstr("link_mass: link panda_link3: 3.3 in wrong.urdf, 3.228604 in panda.xml"));
  const ProgramResult against_table = Run({"consistency", "wrong.urdf", table_, "--samples", "20"});
  EXPECT_EQ(against_table.exit_code, 1);
  EXPECT_THAT(against_table.out,
              HasSubstr("link_mass: link panda_link3: 3.3 in wrong.urdf, 3.228604 in panda.toml"));
  EXPECT_THAT(against_table.out, HasSubstr("in wrong.urdf, "));
}

// Published numbers are rounded: 1.5708 for pi / 2 is 3.7e-6 off.
TEST_F(TwoDescriptions, AreJudgedByDigitsWhenTold) {
  std::string rounded = testing::MakePandaUrdf();
  for (size_t at = rounded.find("1.5707963267948966"); at != std::string::npos;
       at = rounded.find("1.5707963267948966")) {
    rounded.replace(at, 18, "1.5708");
  }
  WriteText(folder_.path() / "rounded.urdf", rounded);
  const ProgramResult strict = Run({"consistency", "rounded.urdf", mjcf_, "--samples", "20"});
  EXPECT_EQ(strict.exit_code, 1);
  EXPECT_THAT(strict.out, HasSubstr("\nDISAGREE: everything agrees to 4 digits, as rounded numbers do; "
                                    "--digits 4 judges by that"));
  const ProgramResult told =
      Run({"consistency", "rounded.urdf", mjcf_, "--samples", "20", "--digits", "4", "--json", "-"});
  EXPECT_EQ(told.exit_code, 0) << told.out;
  const Json results = Json::parse(told.out);
  EXPECT_EQ(results.at("tolerance"), 1e-4);
  EXPECT_EQ(results.at("checks").at("joint_axis").at("bound"), 1e-4);
  EXPECT_GE(results.at("checks").at("joint_axis").at("digits"), 4);
  EXPECT_EQ(results.at("checks").at("link_mass").at("digits"), 16);
  EXPECT_EQ(Run({"consistency", "rounded.urdf", mjcf_, "--samples", "20", "--digits", "7"}).exit_code, 1);
  const ProgramResult tolerant =
      Run({"consistency", "rounded.urdf", mjcf_, "--samples", "20", "--tolerance", "1e-3"});
  EXPECT_EQ(tolerant.exit_code, 0);
  EXPECT_THAT(tolerant.out, HasSubstr("agree to 0.001 in all"));

  // A fault is none of rounding: nothing is said of digits.
  WriteText(folder_.path() / "wrong.urdf",
            ReplaceOnce(testing::MakePandaUrdf(), "<mass value=\"3.228604\"/>", "<mass value=\"3.3\"/>"));
  const ProgramResult wrong = Run({"consistency", "wrong.urdf", mjcf_, "--samples", "20", "--digits", "4"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.out, HasSubstr("link_mass: link panda_link3: 3.3 in wrong.urdf"));
  EXPECT_THAT(wrong.out, ::testing::Not(HasSubstr("rounded numbers")));
  for (const std::string bad : {"0", "1", "-1e-3", "nan", "x"}) {
    EXPECT_EQ(Run({"consistency", "rounded.urdf", mjcf_, "--tolerance", bad}).exit_code, 2) << bad;
  }
  EXPECT_EQ(Run({"consistency", "rounded.urdf", mjcf_, "--digits", "16"}).exit_code, 2);
  EXPECT_EQ(Run({"consistency", "rounded.urdf", mjcf_, "--digits", "4", "--tolerance", "1e-3"}).exit_code, 2);
}

TEST_F(TwoDescriptions, AreImportedAsTablesThatAgreeWithThem) {
  for (const std::string& source : {std::string("panda.urdf"), mjcf_}) {
    const ProgramResult import = Run({"import", source, "--out", "imported.toml"});
    EXPECT_EQ(import.exit_code, 0) << import.err;
    EXPECT_EQ(import.out, "");
    const ProgramResult result = Run({"consistency", "imported.toml", mjcf_, "--samples", "20"});
    EXPECT_EQ(result.exit_code, 0) << result.err << result.out;
  }
  const ProgramResult printed = Run({"import", "panda.urdf"});
  EXPECT_THAT(printed.out,
              HasSubstr("# Parameters of one robot, written by dexcheck import from panda.urdf."));
}

TEST_F(TwoDescriptions, AreImportedWithAListOfWhatWasReadAndLeftOut) {
  const Json urdf = Json::parse(Run({"import", "panda.urdf", "--json"}).out);
  EXPECT_EQ(urdf.at("joints").size(), 7U);
  EXPECT_EQ(urdf.at("base").at("floats"), false);
  EXPECT_TRUE(urdf.at("changes").empty());
  WriteText(folder_.path() / "newer.xml",
            ReplaceOnce(ReadText(mjcf_), "<joint name=\"panda_joint1\"",
                        "<joint actuatorfrcrange=\"-1 1\" name=\"panda_joint1\""));
  const Json read = Json::parse(Run({"import", "newer.xml", "--out", "a.toml", "--json", "-"}).out);
  EXPECT_THAT(read.at("notes").dump(), HasSubstr("forces of actuators: <joint actuatorfrcrange>"));
  const ProgramResult copied = Run({"import", "newer.xml", "--downgrade", "--out", "old.xml", "--json", "-"});
  const Json change = Json::parse(copied.out).at("changes").at(0);
  EXPECT_EQ(change.at("word"), "<joint actuatorfrcrange>");
  EXPECT_EQ(change.at("what"), "left out: forces of actuators, since MuJoCo 3.0.0");
  const Json audit = Json::parse(Run({"audit", "newer.xml", "--json"}).out);
  EXPECT_THAT(audit.at("notes").dump(), HasSubstr("forces of actuators"));
}

TEST_F(TwoDescriptions, AreRefusedInOneLineWhenTheyCannotBeRead) {
  WriteText(folder_.path() / "broken.urdf", "<robot name=\"x\">\n<link name=\"a\">\n</robot>");
  WriteText(folder_.path() / "scene.sdf", "<sdf/>");
  const auto expect_refused = [&](const std::vector<std::string>& arguments, const std::string& problem) {
    const ProgramResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, ::testing::StartsWith("dexcheck: " + problem));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  };
  expect_refused({"consistency", "broken.urdf", mjcf_}, "broken.urdf:2: is not XML");
  expect_refused({"consistency", mjcf_, "scene.sdf"}, "scene.sdf: must be a parameter file (TOML), a URDF");
  expect_refused({"consistency", mjcf_}, "consistency: two files must be given");
  expect_refused({"consistency", "none.urdf", mjcf_}, "none.urdf: cannot be read");
  expect_refused({"import", "broken.urdf", "--out", "x.toml"}, "broken.urdf:2: is not XML");
  expect_refused({"import", table_}, table_ + ": must be a URDF or an MJCF, is a parameter file already");
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "x.toml"));
}

TEST_F(TwoDescriptions, ACopyForAnOlderEngineFindsItsFilesFromAnotherFolder) {
  namespace fs = std::filesystem;
  const fs::path robot = folder_.path() / "robot";
  fs::create_directories(robot / "shapes");
  fs::create_directories(folder_.path() / "copies/old");
  fs::copy(testing::kMjcf + "assets/torus.msh", robot / "shapes/ring.msh");
  WriteText(robot / "arm.xml",
            "<mujoco><worldbody><body name='arm'><joint name='turn' axis='0 0 1'/><geom size='0.1'/>"
            "</body></worldbody></mujoco>");
  for (const char* shapes : {"meshdir='shapes'", "meshdir='./shapes/'", ""}) {
    const std::string file = *shapes == '\0' ? "shapes/ring.msh" : "ring.msh";
    WriteText(robot / "robot.xml", "<mujoco><compiler " + std::string(shapes) +
                                       "/><asset><mesh name='ring' file='" + file +
                                       "'/></asset><include file='arm.xml'/><worldbody><geom type='mesh' "
                                       "mesh='ring'/></worldbody></mujoco>");
    const ProgramResult copied =
        Run({"import", "robot/robot.xml", "--downgrade", "--out", "copies/old/robot.xml"});
    EXPECT_EQ(copied.exit_code, 0) << copied.err;
    const ProgramResult read = Run({"import", "copies/old/robot.xml", "--out", "table.toml"});
    EXPECT_EQ(read.exit_code, 0) << shapes << ": " << read.err;
    EXPECT_THAT(ReadText(folder_.path() / "table.toml"), HasSubstr("turn"));
  }
}

// What is included is copied too, and told by its own file and line.
TEST_F(TwoDescriptions, ACopyIsOfOnePiece) {
  const auto write = [&](const std::string& name, const std::string& text) {
    WriteText(folder_.path() / name, "<mujoco>\n" + text + "</mujoco>");
  };
  write("scene.xml", "<include file='arm.xml'/><worldbody><light/></worldbody>");
  write("arm.xml",
        "<default><joint damping='0.1'/></default><worldbody><include file='link.xml'/></worldbody>");
  write("link.xml",
        "<body name='arm'>\n<joint name='turn' axis='0 1 0' actuatorfrcrange='-1 1'/><geom "
        "size='0.1'/></body>");
  const ProgramResult copied = Run({"import", "scene.xml", "--downgrade", "--out", "copy.xml"});
  EXPECT_EQ(copied.exit_code, 0);
  EXPECT_THAT(copied.err, HasSubstr("link.xml:3: <joint actuatorfrcrange>: left out"));
  EXPECT_THAT(ReadText(folder_.path() / "copy.xml"), ::testing::Not(HasSubstr("include")));
  EXPECT_EQ(Run({"consistency", "copy.xml", "copy.xml", "--samples", "5"}).exit_code, 0);

  const auto expect_refused = [&](const std::string& message) {
    const ProgramResult result = Run({"import", "scene.xml", "--downgrade", "--out", "other.xml"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(message));
    EXPECT_FALSE(std::filesystem::exists(folder_.path() / "other.xml"));
  };
  write("link.xml", "\n<include file='arm.xml'/>");
  expect_refused("link.xml:3: <include>: file \"arm.xml\": must be included once only");
  write("link.xml", "<include file='scene.xml'/>");
  expect_refused("link.xml:2: <include>: file \"scene.xml\": must be included once only");
  write("link.xml", "<include file='none.xml'/>");
  expect_refused("link.xml:2: file \"none.xml\": cannot be read");
  write("link.xml", "<include/>");
  expect_refused("link.xml:2: <include>: must have a file");
  write("link.xml", "<body>");
  expect_refused("link.xml:2: is not XML");
}

// As published robots have them: servos, a tendon, two actuators at one joint, defaults, key frames, sensors.
TEST_F(TwoDescriptions, ACopyWithMotorsIsRun) {
  WriteText(folder_.path() / "servos.xml", R"(<mujoco>
  <compiler angle="radian"/>
  <default>
    <general gear="7" biastype="affine" ctrllimited="true" ctrlrange="-3 3" forcelimited="true" forcerange="-1 1"/>
    <default class="servo"><position kp="200" forcerange="-80 60" gear="2"/></default>
  </default>
  <worldbody><light pos="0 0 3"/>
    <body name="a"><joint name="turn" axis="0 0 1"/><geom size="0.1" pos="0.2 0 0"/>
      <body name="b" pos="0.4 0 0"><joint name="lift" axis="0 1 0"/><geom size="0.1" pos="0.2 0 0"/>
        <body name="c" pos="0.4 0 0"><joint name="slide" type="slide" axis="1 0 0"/><geom size="0.1"/></body>
      </body>
    </body>
  </worldbody>
  <tendon><fixed name="pull"><joint joint="slide" coef="1"/></fixed></tendon>
  <actuator>
    <position class="servo" name="p" joint="turn"/><velocity name="v" joint="turn" gear="1" forcelimited="false"/>
    <motor name="m" joint="lift" gear="50" forcelimited="false"/>
    <general name="t" tendon="pull"/>
  </actuator>
  <sensor><actuatorfrc actuator="p"/><jointpos joint="turn"/></sensor>
  <keyframe><key qpos="0 0 0" ctrl="1 2 3 1"/></keyframe>
</mujoco>)");
  const ProgramResult copied = Run({"import", "servos.xml", "--motors", "--out", "motors.xml"});
  ASSERT_EQ(copied.exit_code, 0) << copied.err;
  EXPECT_THAT(copied.err, HasSubstr("servos.xml:1: <actuator>: 4 actuators replaced by 3 motors"));
  const std::string copy = ReadText(folder_.path() / "motors.xml");
  EXPECT_THAT(copy, HasSubstr("joint=\"turn\" gear=\"1 0 0 0 0 0\" forcelimited=\"false\" "
                              "ctrllimited=\"true\" ctrlrange=\"-160 160\""));
  EXPECT_THAT(copy, HasSubstr("ctrlrange=\"-150 150\""));
  EXPECT_THAT(copy,
              HasSubstr("joint=\"slide\" gear=\"1 0 0 0 0 0\" forcelimited=\"false\" ctrllimited=\"false\""));
  EXPECT_THAT(copy, HasSubstr("<jointpos"));

  ASSERT_EQ(Run({"import", "motors.xml", "--out", "robot.toml"}).exit_code, 0);
  WriteText(folder_.path() / "move.toml", R"(name = "move"
duration = 0.5
start = "rest"
[model]
file = "robot.toml"
[plant]
mjcf = "motors.xml"
[joint_motion]
points = [{ time = 0.5, joints = { turn = 0.3, lift = -0.2, slide = 0.1 } }]
[control]
natural_frequency = 20
damping_ratio = 1
)");
  const ProgramResult ran = Run({"run", "move.toml", "--no-log"});
  EXPECT_EQ(ran.exit_code, 0) << ran.out << ran.err;
  const ProgramResult servos = Run({"run", "move.toml", "--no-log", "--set", "plant.mjcf=servos.xml"});
  EXPECT_EQ(servos.exit_code, 2);
  EXPECT_THAT(servos.err,
              HasSubstr("joint \"turn\": must have one motor, got several; dexcheck import FILE.xml "
                        "--motors --out COPY.xml writes"));
}

}  // namespace
}  // namespace dexcheck::testing::import_command_test
