// dexcheck init: a folder that runs at once.

#include <string>

#include "harness/log/log_reader.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::init_command_test {
namespace {

using InitCommand = CommandTest;

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
  EXPECT_THAT(Read("pair/robot.xml"), HasSubstr("skybox"));
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
  // Existing files are not overwritten.
  EXPECT_TRUE(Refused("init pair.urdf", {"pair", "--out"}));
}

TEST_F(InitCommand, TakesTheUsersMjcfWithMotors) {
  Copy("pair.urdf");
  Copy("pair.xml");
  Expect(0, "init pair.urdf pair.xml --out both");
  EXPECT_THAT(Read("both/robot.xml"), HasSubstr("<motor"));
  EXPECT_EQ(RunMotion(0, "both").at("verdict"), "pass");
  // An MJCF alone suffices as well.
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
  // The limits of an MJCF for a later release are its own or its class's.
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
  // A run says what is left out of its MJCF; what reads its log does not say it of the log's copy again.
  WriteChanged("newer/robot.xml", Read("newer/robot.xml"), "<joint name=\"elbow\"",
               "<joint actuatorfrcrange=\"-3 4\" name=\"elbow\"");
  const std::string said = Expect(0, "run newer/motion.toml --set duration=0.2 --out run").err;
  EXPECT_THAT(said, HasSubstr("newer/robot.xml: left out"));
  EXPECT_THAT(said, Not(HasSubstr("mjcf/robot.xml")));
  EXPECT_EQ(Expect(0, "report run").err, "");
}

// MuJoCo leaves out contacts of neighbours, but not those of a link on a base that is welded to the world.
// Fingers that stand on the world are one robot.
TEST_F(InitCommand, TreesOfOneRobotDoNotTouch) {
  const auto finger = [](const std::string& name, const std::string& at) {
    return "<body name=\"" + name + "\" pos=\"" + at + "\"><joint name=\"" + name +
           "_joint\" axis=\"0 1 0\" range=\"-60 60\"/><geom type=\"capsule\" fromto=\"0 0 0 0 0 0.2\" "
           "size=\"0.03\"/></body>";
  };
  Write("fingers.xml", "<mujoco><worldbody>" + finger("left", "0 0 0") + finger("right", "0 0.05 0") +
                           "</worldbody></mujoco>");
  Expect(0, "init fingers.xml");
  EXPECT_THAT(Read("fingers/robot.xml"), HasSubstr(R"(<exclude body1="left" body2="right"/>)"));
  EXPECT_EQ(RunMotion(0, "fingers").at("verdict"), "pass");
}

TEST_F(InitCommand, ALinkDoesNotTouchTheBaseThatItTurnsOn) {
  std::string mjcf = ReadFixture("pair.xml");
  const auto change = [&](const std::string& from, const std::string& to) {
    WriteChanged("changed", mjcf, from, to);
    mjcf = Read("changed");
  };
  change("<body name=\"upper\" pos=\"0 0 0.1\">",
         "<body name=\"stand\"><geom name=\"a\" size=\"0.2\"/><body name=\"upper\" pos=\"0 0 0.1\">"
         "<geom name=\"b\" size=\"0.05\" mass=\"0\"/>");
  // Explicit pairs are not stopped by exclusions; a margin acts before the end of a range.
  change("</worldbody>", "</body></worldbody><contact><pair geom1=\"a\" geom2=\"b\"/></contact>");
  change("axis=\"0 0 1\"", "axis=\"0 0 1\" margin=\"0.01\"");
  Write("stands.xml", mjcf);
  Expect(0, "init stands.xml");
  EXPECT_THAT(Read("stands/robot.xml"), HasSubstr(R"(<exclude body1="stand" body2="upper"/>)"));
  EXPECT_EQ(RunMotion(0, "stands").at("verdict"), "pass");
}

// Effects on joints other than motors are no part of a run's model, and are listed.
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
  // A link that moves and states no mass.
  const std::string urdf = ReadFixture("pair.urdf");
  WriteChanged("empty.urdf", urdf,
               "<mass value=\"0.8\"/>\n  <inertia ixx=\"0.01\" iyy=\"0.011\" izz=\"0.012\"",
               "<mass value=\"0\"/>\n  <inertia ixx=\"0\" iyy=\"0\" izz=\"0\"");
  EXPECT_THAT(Expect(0, "init empty.urdf").err, HasSubstr("1 g and 1e-6 kg m^2 are written: lower"));
  EXPECT_EQ(RunMotion(0, "empty").at("verdict"), "pass");
}

// A body whose inertia no mass within the robot's reach has; on an upright axis its mass does not show.
TEST_F(InitCommand, AFaultThatNoMotionShowsIsNoSurvivor) {
  Write("spin.urdf", R"(<robot name="spin"><link name="stand"/>
<link name="upper"><inertial><origin xyz="0 0 0.02"/><mass value="1.5"/>
  <inertia ixx="0.01" iyy="0.02" izz="0.022" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="stand"/><child link="upper"/><axis xyz="0 0 1"/>
  <limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>)");
  Expect(0, "init spin.urdf");
  EXPECT_EQ(RunMotion(0, "spin").at("verdict"), "pass");
  const std::string said = Expect(0, "mutate spin/motion.toml --numbers 0 --kinds body").out;
  EXPECT_THAT(said, HasSubstr("no effect: link upper: mass"));
}

// Each joint has its motor: what a URDF couples would be coupled in one of the two alone.
TEST_F(InitCommand, JointsThatFollowOthersMoveByThemselves) {
  WriteChanged("mimic.urdf", ReadFixture("pair.urdf"), "<origin xyz=\"0.3 0 0\"/>",
               "<origin xyz=\"0.3 0 0\"/><mimic joint=\"shoulder\" multiplier=\"0.5\"/>");
  const ProgramResult said = Expect(0, "init mimic.urdf");
  EXPECT_THAT(said.err, HasSubstr("get motors of their own: elbow"));
  EXPECT_THAT(said.out, Not(HasSubstr("the two differ")));
  Expect(0, "consistency mimic/robot.toml mimic/robot.xml --samples 50");
}

// Motors too weak to hold the arm run without their limits; those too weak for the motion get a smaller one.
TEST_F(InitCommand, MovesAsMotorsCan) {
  const std::string urdf = ReadFixture("pair.urdf");
  WriteChanged("weak.urdf", urdf, "upper=\"1\" effort=\"1\"", "upper=\"1\" effort=\"1e-6\"");
  EXPECT_THAT(Expect(0, "init weak.urdf").err, HasSubstr("run without them"));
  EXPECT_EQ(RunMotion(0, "weak").at("verdict"), "pass");
}

// A torque proves nothing where friction holds a joint, or where the joint turns back; forces act where feet
// touch the ground, which an MJCF declares by its spheres.
TEST_F(InitCommand, ARobotWithDryFrictionExplainsItsOwnLog) {
  WriteChanged("rubs.xml", ReadFixture("biped.xml"), "armature=\"0.01\"",
               "armature=\"0.01\" frictionloss=\"0.03\"");
  Expect(0, "init rubs.xml");
  Expect(0, "run rubs/motion.toml --out run --no-report");
  for (const char* model : {"rubs/robot.xml", "rubs/robot.toml"})
    EXPECT_THAT(Expect(0, {"judge", model, "run/log.h5"}).out, HasSubstr("EXPLAINED"));
}

// Published humanoids have defaults of joints that the joint of the base takes, and parked bodies.
TEST_F(InitCommand, WhatIsNoPartOfTheRobotIsLeftOut) {
  const std::string text = ReadFixture("biped.xml");
  const std::string sensor = "<sensor><jointpos joint=\"lid\"/></sensor>";
  const std::string box = "<body name=\"box\" pos=\"9 0 9\"><joint name=\"lid\"/><geom size=\"0.1\"/></body>";
  std::string parked = ReplaceOnce(text, "</worldbody>", box + "</worldbody>" + sensor);
  parked = ReplaceOnce(parked, "<freejoint/>", "<joint type=\"free\" damping=\"0.1\" armature=\"0.2\"/>");
  Write("parked.xml", parked);
  EXPECT_THAT(Expect(0, "init parked.xml").err, HasSubstr("no part of the robot: <body name=\"box\">"));
  EXPECT_THAT(Read("parked/robot.xml"), Not(HasSubstr("lid")));
  EXPECT_EQ(RunMotion(0, "parked").at("verdict"), "pass");
}

// Wherever it is called from.
TEST_F(InitCommand, MeshesLieBesideARobotThatFloats) {
  std::filesystem::create_directory(Path("far"));
  Write("far/tetra.obj", "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  const std::string mesh = R"(<geom type="mesh" mesh="tetra" mass="0" contype="0" conaffinity="0"/>)";
  const std::string text = ReplaceOnce(ReadFixture("biped.xml"), "<freejoint/>", "<freejoint/>" + mesh);
  WriteChanged("far/biped.xml", text, "<worldbody>", R"(<asset><mesh file="tetra.obj"/></asset><worldbody>)");
  EXPECT_THAT(Expect(0, "init far/biped.xml").err, Not(HasSubstr("does not exist")));
  EXPECT_THAT(Read("biped/robot.xml"), HasSubstr("assets/1-tetra.obj"));
}

// Names are read again from TOML, from XML, and from the names of columns.
TEST_F(InitCommand, AnyNamesOfJoints) {
  for (const auto& [first, second] : {std::pair("t", "a;b"), {"a&quot;b,c", "=g\\h'"}, {"a\u00e4", "time"}}) {
    SCOPED_TRACE(first);
    WriteChanged("arm.urdf", ReadFixture("pair.urdf"), "name=\"shoulder\"",
                 std::string("name=\"") + first + "\"");
    WriteChanged("arm.urdf", Read("arm.urdf"), "name=\"elbow\"", std::string("name=\"") + second + "\"");
    for (const char* folder : {"arm", "run"}) std::filesystem::remove_all(Path(folder));
    Expect(0, "init arm.urdf --out arm");
    Expect(0, "run arm/motion.toml --no-report --out run --set settle=0.1");
    Expect(0, "export run --csv run.csv");
    for (const char* recording : {"run", "run.csv"}) {
      const ProgramResult judged = Run({"judge", "arm/robot.toml", recording});
      EXPECT_LE(judged.exit_code, 1) << recording << ": " << judged.err;
      EXPECT_THAT(judged.out, Not(HasSubstr("not judged"))) << recording;
    }
  }
}

TEST_F(InitCommand, WhatOverlapsIsExcluded) {
  Copy("biped.xml");
  Expect(0, "init biped.xml");
  EXPECT_THAT(Read("biped/robot.xml"), HasSubstr(R"(<exclude body1="left_hip" body2="left_thigh"/>)"));
  EXPECT_THAT(Read("biped/robot.xml"), Not(HasSubstr("body1=\"left_thigh\" body2=\"right_thigh\"")));
}

// Between two joints of one body there is a link that the engine does not have.
TEST_F(InitCommand, ABodyMayHaveTwoJoints) {
  WriteChanged("rail.xml", ReadFixture("pair.xml"), "<joint name=\"shoulder\"",
               "<joint name=\"rail\" type=\"slide\" axis=\"1 0 0\"/><joint name=\"shoulder\"");
  Expect(0, "init rail.xml");
  EXPECT_EQ(RunMotion(0, "rail").at("verdict"), "pass");
  Expect(0, "mutate rail/motion.toml --draws 3 --kinds body --duration 0.05 --quiet");
}

// A run's law has no number for a ball joint.
TEST_F(InitCommand, HoldsBallJoints) {
  WriteChanged("balls.xml", ReadFixture("pair.xml"), "<joint name=\"elbow\"",
               "<joint type=\"ball\"/><joint name=\"elbow\"");
  const std::string said = Expect(0, "init balls.xml").err;
  EXPECT_THAT(said, HasSubstr("held, of which a run's law has no number: <joint type=\"ball\">"));
  EXPECT_THAT(Read("balls/robot.xml"), Not(HasSubstr("ball\"")));
  EXPECT_EQ(RunMotion(0, "balls").at("verdict"), "pass");
}

// Friction that stops a joint within a step leaves its law no time to act.
TEST_F(InitCommand, ReducesFrictionThatAStepCannotCarry) {
  // A motion that leaves the motors room for what late torques and coarse encoders cost.
  WriteChanged("fast.urdf", ReadFixture("pair.urdf"), "upper=\"2\" effort=\"1\" velocity=\"1\"",
               "upper=\"2\" effort=\"1\" velocity=\"3\"");
  const std::string urdf = Read("fast.urdf");
  WriteChanged("stuck.urdf", urdf, "<limit lower=\"-1\"",
               "<dynamics damping=\"500\" friction=\"500\"/><limit lower=\"-1\"");
  EXPECT_THAT(Expect(0, "init stuck.urdf").err,
              HasSubstr("friction that would stop a joint within 10 ms is reduced: elbow"));
  EXPECT_EQ(RunMotion(0, "stuck").at("verdict"), "pass");
  Expect(0, "budget stuck/motion.toml --set actuation.delay=0.002 --set sensing.joint_counts=4096");
  // An MJCF is treated the same way.
  WriteChanged("light.xml", ReadFixture("pair.xml"), "<joint name=\"elbow\"",
               "<joint damping=\"500\" name=\"elbow\"");
  EXPECT_THAT(Expect(0, "init light.xml").err, HasSubstr("10 ms is reduced: elbow (500"));
  EXPECT_EQ(RunMotion(0, "light").at("verdict"), "pass");
  Expect(0, "budget light/motion.toml --set actuation.delay=0.002 --set sensing.joint_counts=4096");
  WriteChanged("slow.urdf", urdf, "<limit lower=\"-1\"", "<dynamics damping=\"0.5\"/><limit lower=\"-1\"");
  EXPECT_THAT(Expect(0, "init slow.urdf").err, Not(HasSubstr("reduced")));
  EXPECT_THAT(Read("slow/robot.xml"), HasSubstr("damping=\"0.5\""));
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

// The motion that is written keeps the rates that the URDF allows, and ends at rest.
TEST_F(InitCommand, MovesAsFastAsJointsMay) {
  WriteChanged("slow.urdf", ReadFixture("pair.urdf"), "upper=\"2\" effort=\"1\" velocity=\"1\"",
               "upper=\"2\" effort=\"1\" velocity=\"0.05\"");
  Expect(0, "init slow.urdf");
  Expect(0, "run slow/motion.toml --no-report --out run");
  const LogReader log(Path("run/log.h5"));
  const RowMatrixXd rates = log.ReadSignal("xi");
  const VectorXd fastest = rates.cwiseAbs().colwise().maxCoeff();
  EXPECT_LT(fastest[0], 0.05);
  EXPECT_GT(fastest[0], 0.02);
  EXPECT_GT(fastest[1], 0.2);
  EXPECT_LT(rates.bottomRows(1).cwiseAbs().maxCoeff(), 1e-3 * fastest[0]);
}

// Names are those of the file, as URDF and MJCF allow them.
TEST_F(InitCommand, PartsMayHaveAnyName) {
  std::string text =
      ReplaceOnce(ReadFixture("pair.urdf"), "joint name=\"elbow\"", "joint name=\"left/elbow 2\"");
  text = ReplaceOnce(text, "link name=\"lower\"", "link name=\"left/lower\"");
  WriteChanged("names.urdf", text, "child link=\"lower\"", "child link=\"left/lower\"");
  Expect(0, "init names.urdf");
  Expect(0, {"run", "names/motion.toml", "--no-log", "--set", "settle=0.1", "--set",
             "disturbance=[{type='pulse',body='left/lower',force=[1,0,0],begin=0.1,duration=0.1}]"});
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

// A floating body of the MJCF may be a root of the URDF that is not declared to move.
TEST_F(InitCommand, AUrdfBesideAFloatingMjcfFloats) {
  Write("a.xml", R"(<mujoco><compiler angle="radian"/><worldbody><body name="base" pos="0 0 1"><freejoint/>
<inertial pos="0.01 0 0" mass="4" diaginertia="0.05 0.06 0.07"/><body name="arm" pos="0.1 0 0.05">
<joint name="j" axis="0 1 0" range="-1 1" limited="true"/><inertial pos="0.1 0 0" mass="1" diaginertia="0.002 0.01 0.01"/>
</body></body></worldbody></mujoco>)");
  Write("a.urdf", R"(<robot name="a"><link name="base"><inertial><origin xyz="0.01 0 0"/><mass value="4"/>
<inertia ixx="0.05" iyy="0.06" izz="0.07" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="arm"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>
<inertia ixx="0.002" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><origin xyz="0.1 0 0.05"/><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="20" velocity="3"/></joint></robot>)");
  EXPECT_THAT(Expect(0, "init a.urdf a.xml").err, HasSubstr("the base is held"));
  EXPECT_EQ(RunMotion(0, "a").at("verdict"), "pass");
}

// The engine numbers what has no name, and so does `import`.
TEST_F(InitCommand, JointsWithoutNamesAreNumbered) {
  std::string text = ReadFixture("pair.xml");
  for (const std::string name : {"shoulder", "elbow"}) {
    const size_t at = text.find("<joint name=\"" + name + "\"");
    ASSERT_NE(at, std::string::npos);
    text.erase(at + 6, name.size() + 8);
  }
  Write("plain.xml", text.substr(0, text.find("<actuator>")) + "</mujoco>");
  Expect(0, "init plain.xml");
  EXPECT_THAT(Read("plain/motion.toml"), HasSubstr("\"#0\""));
  EXPECT_EQ(RunMotion(0, "plain").at("verdict"), "pass");
}

// A cart lies in its rail from the first; a mast comes down on the floor only where it moves far.
TEST_F(InitCommand, ItsFirstRunTouchesNothing) {
  Write("cart.xml", R"(<mujoco><compiler angle="radian"/><worldbody>
<geom name="rail" type="capsule" fromto="-1 0 0 1 0 0" size="0.02"/><body name="cart">
<joint name="slider" type="slide" axis="1 0 0" range="-1 1" limited="true"/><geom type="capsule" fromto="-0.1 0 0 0.1 0 0" size="0.1" mass="4"/>
<body name="pole"><joint name="hinge" axis="0 1 0" range="-1.5 1.5" limited="true"/>
<geom type="capsule" fromto="0 0 0 0 0 0.6" size="0.049" mass="2"/></body></body></worldbody></mujoco>)");
  Expect(0, "init cart.xml");
  EXPECT_EQ(RunMotion(0, "cart").at("verdict"), "pass");
  Write("mast.xml",
        R"(<mujoco><compiler angle="radian"/><worldbody><geom name="floor" type="plane" size="3 3 0.1"/>
<body name="mast" pos="0 0 0.12"><joint name="tilt" axis="0 1 0" range="-2 2" limited="true"/>
<geom type="capsule" fromto="0.05 0 0 0.5 0 0" size="0.03" mass="1"/></body></worldbody></mujoco>)");
  Expect(0, "init mast.xml");
  EXPECT_EQ(RunMotion(0, "mast").at("verdict"), "pass");
}

// A robot that no motion makes pass is refused before anything is written.
TEST_F(InitCommand, ARobotThatCannotPassIsRefused) {
  WriteChanged("swims.xml", ReadFixture("pair.xml"), "<worldbody>",
               "<option density=\"1000\" viscosity=\"0.1\"/><worldbody>");
  const std::string said = Expect(2, "init swims.xml").err;
  EXPECT_THAT(said, HasSubstr("swims.xml: even the smallest motion fails its run: model (medium of density"));
  EXPECT_FALSE(Has("swims"));
}

}  // namespace
}  // namespace dexcheck::testing::init_command_test
