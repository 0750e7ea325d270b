// dexcheck import, and dexcheck consistency between two descriptions of any kind.

#include "tests/harness/cli/dexcheck_program.h"
#include "tests/harness/descriptions/panda_urdf.h"

namespace dexcheck::testing::import_command_test {
namespace {

class TwoDescriptions : public CommandTest {
 protected:
  TwoDescriptions() {
    Write("panda.urdf", MakePandaUrdf());
    WriteChanged("wrong.urdf", MakePandaUrdf(), "<mass value=\"3.228604\"/>", "<mass value=\"3.3\"/>");
  }
};

TEST_F(TwoDescriptions, AgreeInEveryPairing) {
  const std::vector<std::string> files = {"panda.urdf", kPandaXml, kPandaToml};
  for (const std::string& a : files) {
    for (const std::string& b : files) EXPECT_EQ(Compare(0, a, b).at("verdict"), "pass") << a << " " << b;
  }
}

TEST_F(TwoDescriptions, ReportWhatOneLacksAndWhatDiffers) {
  WriteChanged("motors.xml", ReadText(kPandaXml), "armature=\"0\"", "armature=\"0.1\"");
  const Json results = Compare(1, "panda.urdf", "motors.xml");
  EXPECT_EQ(results.at("verdict"), "disagreement");
  EXPECT_EQ(results.at("findings").size(), 7U);
  for (const Json& finding : results.at("findings")) EXPECT_EQ(finding.at("check"), "joint_armature");
  EXPECT_THAT(results.at("not_compared"), Contains(AllOf(HasSubstr("gravity"), HasSubstr("motors.xml"))));
  for (const std::string& other : {kPandaXml, kPandaToml})
    EXPECT_TRUE(HasFinding(Compare(1, "wrong.urdf", other), "link_mass", "link panda_link3", 3.3, 3.228604));
}

// Published numbers are rounded: 1.5708 for pi / 2 is 3.7e-6 off.
TEST_F(TwoDescriptions, AreJudgedByDigitsOnRequest) {
  std::string rounded = MakePandaUrdf();
  const std::string right_angle = "1.5707963267948966";
  for (size_t at = rounded.find(right_angle); at != std::string::npos; at = rounded.find(right_angle))
    rounded.replace(at, right_angle.size(), "1.5708");
  Write("rounded.urdf", rounded);
  const auto verdict = [&](const std::string& file, const Words& more) {
    return FirstLine(
        Expect(1, Words{"consistency", file, kPandaXml, "--samples", "20", "--quiet"} + more).out);
  };
  EXPECT_THAT(verdict("rounded.urdf", "--exact"), HasSubstr("4 digits"));
  const Json results = Compare(0, "rounded.urdf", kPandaXml, "--digits 4");
  EXPECT_EQ(results.at("tolerance"), 1e-4);
  EXPECT_EQ(results.at("checks").at("joint_axis").at("bound"), 1e-4);
  EXPECT_GE(results.at("checks").at("joint_axis").at("digits"), 4);
  EXPECT_EQ(results.at("checks").at("link_mass").at("digits"), 16);
  Compare(1, "rounded.urdf", kPandaXml, "--digits 7");
  EXPECT_EQ(Compare(0, "rounded.urdf", kPandaXml, "--tolerance 1e-3").at("tolerance"), 1e-3);
  EXPECT_TRUE(Refused("consistency rounded.urdf panda.urdf --digits 4 --tolerance 1e-3", {"--tolerance"}));

  // A fault is none of rounding: nothing is said of digits.
  EXPECT_TRUE(
      HasFinding(Compare(1, "wrong.urdf", kPandaXml, "--digits 4"), "link_mass", "link panda_link3", 3.3));
  EXPECT_THAT(verdict("wrong.urdf", "--digits 4"), Not(HasSubstr("rounded")));
}

TEST_F(TwoDescriptions, AreImportedAsTablesThatAgreeWithThem) {
  for (const std::string& source : {std::string("panda.urdf"), kPandaXml}) {
    EXPECT_EQ(Expect(0, {"import", source, "--out", "imported.toml"}).out, "");
    EXPECT_EQ(Compare(0, "imported.toml", kPandaXml).at("verdict"), "pass");
    EXPECT_EQ(Expect(0, {"import", source}).out, Read("imported.toml"));
  }
}

TEST_F(TwoDescriptions, AreImportedWithAListOfWhatWasReadAndLeftOut) {
  const Json urdf = RunJson(0, "import panda.urdf");
  EXPECT_EQ(urdf.at("joints").size(), 7U);
  EXPECT_EQ(urdf.at("base").at("floats"), false);
  EXPECT_TRUE(urdf.at("changes").empty());
  WriteChanged("newer.xml", ReadText(kPandaXml), "<joint name=\"panda_joint1\"",
               "<joint actuatorfrcrange=\"-1 1\" name=\"panda_joint1\"");
  const std::string word = "<joint actuatorfrcrange>";
  EXPECT_THAT(RunJson(0, "import newer.xml --out a.toml").at("notes").dump(), HasSubstr(word));
  const Json change = RunJson(0, "import newer.xml --downgrade --out old.xml").at("changes").at(0);
  EXPECT_EQ(change.at("word"), word);
  EXPECT_THAT(change.at("what"), HasSubstr("3.0.0"));
  EXPECT_THAT(Json::parse(Run("audit newer.xml --json").out).at("notes").dump(), HasSubstr("actuator"));
}

TEST_F(TwoDescriptions, ACopyForAnOlderEngineFindsItsFilesFromAnotherFolder) {
  for (const char* folder : {"robot/shapes", "copies/old"}) std::filesystem::create_directories(Path(folder));
  std::filesystem::copy(kMjcf + "assets/torus.msh", Path("robot/shapes/ring.msh"));
  Write("robot/arm.xml",
        "<mujoco><worldbody><body name='arm'><joint name='turn' axis='0 0 1'/><geom size='0.1'/>"
        "</body></worldbody></mujoco>");
  for (const std::string shapes : {"meshdir='shapes'", "meshdir='./shapes/'", ""}) {
    Write("robot/robot.xml", "<mujoco><compiler " + shapes + "/><asset><mesh name='ring' file='" +
                                 (shapes.empty() ? "shapes/" : "") +
                                 "ring.msh'/></asset><include file='arm.xml'/><worldbody><geom type='mesh' "
                                 "mesh='ring'/></worldbody></mujoco>");
    Expect(0, "import robot/robot.xml --downgrade --out copies/old/robot.xml");
    Expect(0, "import copies/old/robot.xml --out table.toml");
    EXPECT_THAT(Read("table.toml"), HasSubstr("turn"));
  }
}

// Included files are copied too, and named by their own file and line.
TEST_F(TwoDescriptions, ACopyIsOfOnePiece) {
  const auto write = [&](const std::string& name, const std::string& text) {
    Write(name, "<mujoco>\n" + text + "</mujoco>");
  };
  write("scene.xml", "<include file='arm.xml'/><worldbody><light/></worldbody>");
  write("arm.xml",
        "<default><joint damping='0.1'/></default><worldbody><include file='link.xml'/></worldbody>");
  write("link.xml",
        "<body name='arm'>\n<joint name='turn' axis='0 1 0' actuatorfrcrange='-1 1'/><geom "
        "size='0.1'/></body>");
  EXPECT_THAT(Expect(0, "import scene.xml --downgrade --out copy.xml").err,
              HasSubstr("link.xml:3: <joint actuatorfrcrange>"));
  EXPECT_THAT(Read("copy.xml"), Not(HasSubstr("include")));
  Expect(0, "consistency copy.xml copy.xml --samples 5");

  for (const auto& [text, parts] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"\n<include file='arm.xml'/>", {"link.xml:3: <include>", "\"arm.xml\"", "once"}},
           {"<include file='scene.xml'/>", {"link.xml:2: <include>", "\"scene.xml\"", "once"}},
           {"<include file='none.xml'/>", {"link.xml:2: ", "\"none.xml\"", "cannot be read"}},
           {"<include/>", {"link.xml:2: <include>", "file"}},
           {"<body>", {"link.xml:2: ", "not XML"}}}) {
    write("link.xml", text);
    EXPECT_TRUE(Refused("import scene.xml --downgrade --out other.xml", parts));
    EXPECT_FALSE(Has("other.xml"));
  }
}

// Published robots have servos, a tendon, two actuators at one joint, defaults, key frames, sensors.
TEST_F(TwoDescriptions, ACopyWithMotorsIsRun) {
  Write("servos.xml", R"(<mujoco>
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
  EXPECT_THAT(Expect(0, "import servos.xml --motors --out motors.xml").err,
              HasSubstr("servos.xml:1: <actuator>: 4 actuators replaced by 3 motors"));
  const std::string copy = Read("motors.xml");
  EXPECT_THAT(copy, HasSubstr("joint=\"turn\" gear=\"1 0 0 0 0 0\" forcelimited=\"false\" "
                              "ctrllimited=\"true\" ctrlrange=\"-160 160\""));
  EXPECT_THAT(copy, HasSubstr("ctrlrange=\"-150 150\""));
  EXPECT_THAT(copy,
              HasSubstr("joint=\"slide\" gear=\"1 0 0 0 0 0\" forcelimited=\"false\" ctrllimited=\"false\""));
  EXPECT_THAT(copy, HasSubstr("<jointpos"));

  Expect(0, "import motors.xml --out robot.toml");
  Write("move.toml", R"(name = "move"
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
  Expect(0, "run move.toml --no-log");
  EXPECT_TRUE(Refused("run move.toml --no-log --set plant.mjcf=servos.xml",
                      {"joint \"turn\"", "one motor", "dexcheck import FILE.xml --motors --out COPY.xml"}));
}

}  // namespace
}  // namespace dexcheck::testing::import_command_test
