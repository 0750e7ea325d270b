// dexcheck init: a folder that runs at once.

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::init_command_test {
namespace {

class InitCommand : public CommandTest {
 protected:
  /// The folder's motion, shortened.
  [[nodiscard]] Json RunMotion(int exit_code, const std::string& folder) const {
    return RunJson(exit_code, {"run", folder + "/motion.toml", "--no-log", "--set", "settle=0.1"});
  }
};

TEST_F(InitCommand, MakesAFolderOfAUrdfThatRuns) {
  Copy("pair.urdf");
  Expect(0, "init pair.urdf");
  for (const char* file :
       {"robot.toml", "robot.xml", "motion.toml", "gains.toml", ".github/workflows/dexcheck.yml"})
    EXPECT_TRUE(Has(std::string("pair/") + file)) << file;
  const Json run = RunMotion(0, "pair");
  EXPECT_EQ(run.at("verdict"), "pass");
  EXPECT_GT(run.at("tracking").at("joint_error_max_rad").get<double>(), 0.0);
  // The MJCF is the URDF to rounding, and an independent one agrees with it.
  for (const char* other : {"pair.urdf", "pair/robot.toml"})
    EXPECT_EQ(
        RunJson(0, {"consistency", other, "pair/robot.xml", "--exact", "--samples", "50"}).at("outcome"),
        "rounding");
  // Its gains, and the best of the study, may take the place of the scenario's.
  EXPECT_TRUE(run.at("margins").at("one_torque").at("phase_rad").get<double>() > 0.5);
  EXPECT_THAT(run.at("gain_card").get<std::string>(), HasSubstr("[control]\nlaw = \"computed_torque\"\n"));
  const std::string study = Expect(0, "study run pair/gains.toml --db gains.db").out;
  EXPECT_THAT(study, HasSubstr("18 of 18"));
  const std::string motion = Read("pair/motion.toml");
  const size_t from = motion.find("[control]"), to = motion.find("[expect]");
  for (const std::string& card :
       {run.at("gain_card").get<std::string>(), study.substr(study.find("# your gains"))}) {
    Write("pair/better.toml", motion.substr(0, from) + card + "\n" + motion.substr(to));
    EXPECT_EQ(RunJson(0, {"run", "pair/better.toml", "--no-log", "--set", "duration=0.5"}).at("verdict"),
              "pass");
  }
  // What is there is not written over.
  EXPECT_TRUE(Refused("init pair.urdf", {"pair", "--out"}));
}

TEST_F(InitCommand, TakesTheUsersMjcfWithMotors) {
  Copy("pair.urdf");
  Copy("pair.xml");
  Expect(0, "init pair.urdf pair.xml --out both");
  EXPECT_THAT(Read("both/robot.xml"), HasSubstr("<motor"));
  EXPECT_EQ(RunMotion(0, "both").at("verdict"), "pass");
  // Of an MJCF alone, too.
  Expect(0, "init pair.xml --out alone");
  EXPECT_EQ(RunMotion(0, "alone").at("verdict"), "pass");
  // Few digits in one of the two are a tolerance of the run.
  WriteChanged("short.urdf", ReadFixture("pair.urdf"), "value=\"0.8\"", "value=\"0.80004\"");
  Expect(0, "init short.urdf pair.xml --out short");
  EXPECT_THAT(Read("short/motion.toml"), HasSubstr("tolerance"));
  EXPECT_EQ(RunMotion(0, "short").at("verdict"), "pass");
  // A difference is said, and found by the run.
  WriteChanged("wrong.urdf", ReadFixture("pair.urdf"), "value=\"0.8\"", "value=\"0.9\"");
  EXPECT_THAT(Expect(0, "init wrong.urdf pair.xml --out wrong").out, HasSubstr("dexcheck consistency"));
  EXPECT_EQ(RunMotion(1, "wrong").at("checks").at("link_mass").at("pass"), false);
}

TEST_F(InitCommand, MotorsHaveTheLimitsThatTheFilesState) {
  const std::string limit = R"(ctrllimited="true" ctrlrange="-1 1")";
  Copy("pair.urdf");
  Copy("pair.xml");
  Expect(0, "init pair.urdf --out alone");
  EXPECT_THAT(Read("alone/robot.xml"), HasSubstr(limit));
  Expect(0, "init pair.urdf pair.xml --out both");
  EXPECT_THAT(Read("both/robot.xml"), HasSubstr(limit));
  Expect(0, "init pair.xml --out none");
  EXPECT_THAT(Read("none/robot.xml"), Not(HasSubstr("ctrlrange")));
  // Of an MJCF for a later release, its own or its class's.
  WriteChanged(
      "newer.xml", ReadFixture("pair.xml"), "<worldbody>",
      "<default><default class='strong'><joint actuatorfrcrange='-7 7'/></default></default><worldbody>");
  WriteChanged("newer.xml", Read("newer.xml"), "<joint name=\"shoulder\"",
               "<joint class='strong' name=\"shoulder\"");
  WriteChanged("newer.xml", Read("newer.xml"), "<joint name=\"elbow\"",
               "<joint actuatorfrcrange='-3 4' name=\"elbow\"");
  Expect(0, "init newer.xml --out newer");
  EXPECT_THAT(Read("newer/robot.xml"), HasSubstr(R"(ctrlrange="-7 7")"));
  EXPECT_THAT(Read("newer/robot.xml"), HasSubstr(R"(ctrlrange="-3 3")"));
}

// MuJoCo leaves out contacts of neighbours, but not those of a link on a base that is welded to the world.
TEST_F(InitCommand, ALinkDoesNotTouchTheBaseThatItTurnsOn) {
  std::string mjcf = ReadFixture("pair.xml");
  const auto change = [&](const std::string& from, const std::string& to) {
    WriteChanged("changed", mjcf, from, to);
    mjcf = Read("changed");
  };
  change("<body name=\"upper\" pos=\"0 0 0.1\">",
         "<body name=\"stand\"><geom size=\"0.2\"/><body name=\"upper\" pos=\"0 0 0.1\"><geom size=\"0.05\" "
         "mass=\"0\"/>");
  change("</worldbody>", "</body></worldbody>");
  Write("stands.xml", mjcf);
  Expect(0, "init stands.xml");
  EXPECT_THAT(Read("stands/robot.xml"), HasSubstr(R"(<exclude body1="stand" body2="upper"/>)"));
  EXPECT_EQ(RunMotion(0, "stands").at("verdict"), "pass");
}

// What acts on joints beside motors is no part of a run's model, and is said.
TEST_F(InitCommand, LeavesOutWhatActsBesideMotors) {
  WriteChanged("held.xml", ReadFixture("pair.xml"), "<joint name=\"elbow\"",
               "<joint stiffness=\"3\" name=\"elbow\"");
  WriteChanged("held.xml", Read("held.xml"), "<body name=\"upper\"", "<body gravcomp=\"1\" name=\"upper\"");
  WriteChanged("held.xml", Read("held.xml"), "</worldbody>",
               "</worldbody><equality><joint joint1=\"elbow\" joint2=\"shoulder\"/></equality>"
               "<tendon><fixed name=\"t\"><joint joint=\"elbow\" coef=\"1\"/></fixed></tendon>"
               "<actuator><position tendon=\"t\" kp=\"2\"/></actuator>");
  const std::string said = Expect(0, "init held.xml").err;
  for (const char* word : {"<joint stiffness>", "<body gravcomp>", "<equality joint>", "<tendon fixed>"})
    EXPECT_THAT(said, HasSubstr(word));
  EXPECT_EQ(RunMotion(0, "held").at("verdict"), "pass");
}

// Published files have them: no engine takes such an inertia, and a range of no width is none.
TEST_F(InitCommand, MendsWhatTheEngineRefuses) {
  WriteChanged("thin.urdf", ReadFixture("pair.urdf"), "izz=\"0.022\"", "izz=\"0.04\"");
  WriteChanged("thin.urdf", Read("thin.urdf"), "lower=\"-2\" upper=\"2\"", "");
  const std::string said = Expect(0, "init thin.urdf").err;
  EXPECT_THAT(said, HasSubstr("nearest"));
  EXPECT_THAT(said, HasSubstr("no width are left out: shoulder"));
  EXPECT_EQ(RunMotion(0, "thin").at("verdict"), "pass");
}

// Motors too weak to hold the arm run without their limits; those too weak for the motion get a smaller one.
TEST_F(InitCommand, MovesAsMotorsCan) {
  const std::string urdf = ReadFixture("pair.urdf");
  WriteChanged("weak.urdf", urdf, "upper=\"1\" effort=\"1\"", "upper=\"1\" effort=\"1e-6\"");
  EXPECT_THAT(Expect(0, "init weak.urdf").err, HasSubstr("run without them"));
  EXPECT_EQ(RunMotion(0, "weak").at("verdict"), "pass");
}

// A floating base stands on what is lowest of the robot and can touch.
TEST_F(InitCommand, ARobotWithAFloatingBaseStands) {
  Expect(0, {"init", kMjcf + "quadruped_scene.xml", "--out", "dog"});
  EXPECT_THAT(Read("dog/motion.toml"), HasSubstr(R"(feet = ["foot_1", "foot_2", "foot_3", "foot_4"])"));
  const Json run = RunMotion(0, "dog");
  EXPECT_EQ(run.at("verdict"), "pass");
  EXPECT_GT(run.at("checks").at("foot_cone_use").at("max").get<double>(), 0.0);
  // Without places to stand on it is refused.
  EXPECT_TRUE(
      Refused({"init", kMjcf + "quadruped.xml", "--out", "none"}, {"quadruped.xml", "floats", "got 0"}));
  EXPECT_FALSE(Has("none"));
}

// The weight of an arm in a horizontal plane asks for no torque, and one that hangs has a tilt of pi.
TEST_F(InitCommand, ArmsMayLieOrHang) {
  const std::string mjcf = ReadFixture("pair.xml");
  WriteChanged("lies.xml", mjcf, "<worldbody>", "<option gravity=\"0 0 0\"/><worldbody>");
  WriteChanged("hangs.xml", mjcf, "<body name=\"upper\"",
               "<body name=\"stand\" quat=\"0 1 0 0\"><body name=\"upper\"");
  WriteChanged("hangs.xml", Read("hangs.xml"), "</worldbody>", "</body></worldbody>");
  for (const std::string name : {"lies", "hangs"}) {
    SCOPED_TRACE(name);
    Expect(0, "init " + name + ".xml");
    EXPECT_EQ(RunMotion(0, name).at("verdict"), "pass");
  }
}

TEST_F(InitCommand, CopiesShippedScenarios) {
  for (const std::string name : {"paper", "panda-reach", "two-hands"}) {
    SCOPED_TRACE(name);
    Expect(0, {"init", "--from", name});
    EXPECT_EQ(RunJson(0, {"run", name + "/" + name + ".toml", "--no-log", "--set", "duration=0.02", "--set",
                          "settle=0.1", "--unset", "expect"})
                  .at("verdict"),
              "pass");
    // Its files are the folder's.
    EXPECT_THAT(Read(name + "/" + name + ".toml"), Not(HasSubstr("../")));
  }
}

TEST_F(InitCommand, RefusesInOneLine) {
  Copy("two.toml");
  Copy("pair.xml");
  EXPECT_TRUE(Refused("init", {"init", "--from"}));
  EXPECT_TRUE(Refused("init two.toml", {"two.toml", "URDF"}));
  EXPECT_TRUE(Refused("init pair.xml pair.xml", {"pair.xml", "two MJCFs"}));
  EXPECT_TRUE(Refused("init nothing.urdf", {"nothing.urdf"}));
  EXPECT_TRUE(Refused("init --from papr", {"papr", "paper"}));
  Write("floats.urdf", R"(<robot name="r"><link name="world"/><link name="l"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="floating"><parent link="world"/><child link="l"/></joint></robot>)");
  EXPECT_TRUE(Refused("init floats.urdf", {"floats.urdf", "base", "floats"}));
  EXPECT_FALSE(Has("floats"));
}

}  // namespace
}  // namespace dexcheck::testing::init_command_test
