// An arm of the user's own, from nothing but its MJCF: import, write a scenario, run.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/common/matchers.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::own_arm_test {
namespace {

using Json = nlohmann::json;

// A turning column, a lift that slides on it, an elbow; sizes and masses by geoms alone.
constexpr const char* kArm = R"(<mujoco model="own arm">
  <compiler angle="degree"/>
  <option timestep="0.001" gravity="0 0 -9.81"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="column" pos="0 0 0.5">
      <joint name="turn" type="hinge" axis="0 0 1" range="-170 170" limited="true" damping="0.1"/>
      <geom type="cylinder" size="0.05 0.2" mass="3"/>
      <body name="carriage" pos="0.1 0 0">
        <joint name="lift" type="slide" axis="0 0 1" range="-0.2 0.3" limited="true" damping="2"/>
        <geom type="box" size="0.1 0.04 0.04" mass="1.5" pos="0.1 0 0"/>
        <body name="forearm" pos="0.25 0 0">
          <joint name="elbow" type="hinge" axis="0 1 0" range="-120 120" limited="true" armature="0.01"/>
          <geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0" mass="0.8"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="turn"/><motor joint="lift"/><motor joint="elbow"/>
  </actuator>
</mujoco>
)";

constexpr const char* kScenario = R"(name = "own"
duration = 1.0
settle = 0.2
start = "rest"
[model]
file = "arm.toml"
[plant]
mjcf = "arm.xml"
[joint_motion]
start = { lift = 0.1, elbow = 0.5 }
points = [{ time = 1, joints = { turn = 1.0, lift = -0.1 } }]
oscillations = [{ joint = "elbow", amplitude_deg = 10, frequency = 1, ramp_time = 0.5 }]
[control]
natural_frequency = { all = 15, elbow = 30 }
damping_ratio = 1
[expect]
joints = 1e-3
)";

class OwnArm : public ::testing::Test {
 protected:
  OwnArm() {
    WriteText(folder_.path() / "arm.xml", kArm);
    WriteText(folder_.path() / "own.toml", kScenario);
    const ProgramResult imported = Run({"import", "arm.xml", "--out", "arm.toml"});
    EXPECT_EQ(imported.exit_code, 0) << imported.err;
  }

  [[nodiscard]] ProgramResult Run(const std::vector<std::string>& arguments) const {
    return RunDexcheck(arguments, {.folder = folder_.path()});
  }
  [[nodiscard]] ProgramResult RunWith(const std::string& assignment) const {
    return Run({"run", "own.toml", "--no-log", "--set", assignment});
  }

  TempFolder folder_;
};

TEST_F(OwnArm, IsRunReportedDrawnAndReplayed) {
  const ProgramResult result = Run({"run", "own.toml", "--out", "run"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("joints: largest error "));
  EXPECT_THAT(result.out, HasSubstr("PASS"));
  const Json summary = Json::parse(ReadText(folder_.path() / "run/summary.json"));
  EXPECT_GT(summary.at("tracking").at("joint_error_max_rad").get<double>(), 0.0);
  EXPECT_FALSE(summary.at("tracking").contains("position_error_max_m"));
  EXPECT_TRUE(summary.at("checks").contains("joint_dynamics"));
  EXPECT_FALSE(summary.at("checks").contains("contact_force"));
  const std::string page = ReadText(folder_.path() / "run/report.html");
  EXPECT_THAT(page, HasSubstr("largest error of a joint"));
  for (const char* title : {"Motion of the joints", "Errors of the joints", "Torques of the joints"})
    EXPECT_THAT(page, HasSubstr(std::string("<figcaption>") + title + "</figcaption>"));
  // Nothing here is in the paper.
  for (const char* papers : {"the paper's figures", "<b>Figure"}) EXPECT_THAT(page, Not(HasSubstr(papers)));
  const ProgramResult picture =
      Run({"render", "run", "--still", "0.5", "--size", "320x240", "--out", "picture.png"});
  EXPECT_EQ(picture.exit_code, 0) << picture.err;
  EXPECT_EQ(Run({"run", "--replay", "run"}).exit_code, 0);
}

// As descriptions that were made for dynamics often are.
TEST_F(OwnArm, WithoutShapesHasAPageToo) {
  std::string text = kArm;
  for (const char* geom : {R"(<geom type="cylinder" size="0.05 0.2" mass="3"/>)",
                           R"(<geom type="box" size="0.1 0.04 0.04" mass="1.5" pos="0.1 0 0"/>)",
                           R"(<geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0" mass="0.8"/>)"}) {
    text = ReplaceOnce(text, geom, R"(<inertial pos="0.1 0 0.05" mass="1" diaginertia="0.02 0.02 0.02"/>)");
  }
  WriteText(folder_.path() / "arm.xml", text);
  ASSERT_EQ(Run({"import", "arm.xml", "--out", "arm.toml"}).exit_code, 0);
  const ProgramResult result = Run({"run", "own.toml", "--out", "run"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(ReadText(folder_.path() / "run/report.html"), HasSubstr("Robot at the end"));
  const ProgramResult picture =
      Run({"render", "run", "--still", "0.5", "--size", "320x240", "--out", "picture.png"});
  EXPECT_EQ(picture.exit_code, 0) << picture.err;
}

TEST_F(OwnArm, RunsWithoutTheEngine) {
  const ProgramResult result = RunWith("plant.type=rigid");
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("joints: largest error "));
}

TEST_F(OwnArm, WithABallJointIsComparedButNotRun) {
  WriteText(
      folder_.path() / "arm.xml",
      ReplaceOnce(kArm,
                  R"(name="turn" type="hinge" axis="0 0 1" range="-170 170" limited="true" damping="0.1")",
                  R"(name="turn" type="ball")"));
  ASSERT_EQ(Run({"import", "arm.xml", "--out", "ball.toml"}).exit_code, 0);
  EXPECT_EQ(Run({"consistency", "ball.toml", "arm.xml", "--samples", "20"}).exit_code, 0);
  EXPECT_TRUE(IsRefused(RunWith("model.file=ball.toml"), {"ball.toml", "ball", "turn", "run"}));
}

// The engine's friction that holds a joint, or lets it slide, is known when the parameters state it.
TEST_F(OwnArm, WithDryFrictionIsRun) {
  const std::string with = ReplaceOnce(kArm, "damping=\"0.1\"", "damping=\"0.1\" frictionloss=\"0.5\"");
  WriteText(folder_.path() / "arm.xml", ReplaceOnce(with, "armature=\"0.01\"", "frictionloss=\"0.2\""));
  const ProgramResult hidden = Run({"run", "own.toml", "--no-log"});
  EXPECT_EQ(hidden.exit_code, 1) << hidden.out;
  EXPECT_THAT(hidden.out, HasSubstr("joint_dry_friction: joint turn on link world: 0 in the model, 0.5 in"));
  EXPECT_THAT(hidden.out, HasSubstr("inverse_dynamics_robot"));
  EXPECT_THAT(hidden.out, HasSubstr("FAILS"));

  ASSERT_EQ(Run({"import", "arm.xml", "--out", "arm.toml"}).exit_code, 0);
  const ProgramResult result = Run({"run", "own.toml", "--out", "run", "--set", "expect.joints=0.05"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_EQ(Run({"run", "--replay", "run"}).exit_code, 0);
  EXPECT_TRUE(IsRefused(RunWith("plant.type=rigid"), {"plant.type", "dry friction", "\"turn\""}));
}

// As the fingers of a closed gripper do: rounding puts it beyond its range, by 2e-19 m here.
TEST_F(OwnArm, AJointMayRestAtTheEndOfItsRange) {
  WriteText(folder_.path() / "arm.xml", ReplaceOnce(kArm, "range=\"-0.2 0.3\"", "range=\"0 0.3\""));
  ASSERT_EQ(Run({"import", "arm.xml", "--out", "arm.toml"}).exit_code, 0);
  const std::string rests = ReplaceOnce(kScenario, "lift = 0.1, ", "");
  WriteText(folder_.path() / "own.toml", ReplaceOnce(rests, ", lift = -0.1", ""));
  const ProgramResult result = Run({"run", "own.toml", "--no-log"});
  EXPECT_EQ(result.exit_code, 0) << result.out;
}

// Most of the MJCFs that are published name one; by it velocities change by other than dt qacc.
TEST_F(OwnArm, IsSteppedByEulerWhateverItsMjcfSays) {
  for (const char* integrator : {"implicit", "RK4"}) {
    WriteText(folder_.path() / "arm.xml",
              ReplaceOnce(kArm, "<worldbody>",
                          "<option integrator=\"" + std::string(integrator) + "\"/><worldbody>"));
    const ProgramResult result = Run({"run", "own.toml", "--no-log"});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  }
  const ProgramResult own = RunWith("plant.implicit_damping=true");
  EXPECT_THAT(own.out, HasSubstr("cause: integrator"));
}

TEST_F(OwnArm, DoesNotPassWithAnotherMass) {
  WriteText(folder_.path() / "arm.xml", ReplaceOnce(kArm, "mass=\"0.8\"", "mass=\"0.9\""));
  const ProgramResult result = Run({"run", "own.toml", "--no-log"});
  EXPECT_EQ(result.exit_code, 1) << result.out;
  EXPECT_THAT(result.out, HasSubstr("forearm"));
}

// A number that was rounded when it was printed.
TEST_F(OwnArm, PassesToTheDigitsThatItsNumbersHave) {
  WriteText(folder_.path() / "arm.xml", ReplaceOnce(kArm, "mass=\"0.8\"", "mass=\"0.800004\""));
  const auto run = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"run", "own.toml", "--quiet"});
    return Run(options);
  };
  EXPECT_EQ(run({"--no-log"}).exit_code, 1);
  EXPECT_EQ(run({"--no-log", "--digits", "6"}).exit_code, 1);
  const ProgramResult judged = run({"--digits", "5", "--out", "judged"});
  EXPECT_EQ(judged.exit_code, 0) << judged.out << judged.err;
  EXPECT_THAT(Run({"run", "own.toml", "--no-log", "--digits", "5"}).out,
              HasSubstr("judged to a relative tolerance of 1e-05\n"));
  EXPECT_EQ(run({"--no-log", "--tolerance", "2e-5"}).exit_code, 0);
  EXPECT_EQ(run({"--no-log", "--set", "tolerance=2e-5"}).exit_code, 0);
  const Json summary = Json::parse(ReadText(folder_.path() / "judged/summary.json"));
  EXPECT_EQ(summary.at("checks").at("M_bar").at("bound").get<double>(), 1e-5);
  EXPECT_EQ(Run({"run", "--replay", "judged"}).exit_code, 0);
  EXPECT_TRUE(IsRefused(run({"--no-log", "--set", "tolerance=1"}), {"tolerance", "below 1", "1"}));
  EXPECT_EQ(Run({"run", "--replay", "judged", "--digits", "5"}).exit_code, 2);
}

TEST_F(OwnArm, WhatCannotBeIsOneLine) {
  struct Case {
    const char* assignment;
    std::vector<std::string> parts;
  };
  const Case cases[] = {
      {"joint_motion.start={ elbo = 1 }", {"joint_motion.start", "\"elbo\"", "\"elbow\"?"}},
      {"joint_motion.start={ lift = 0.4 }",
       {"joint_motion.start", "\"lift\" must be from -0.2 to 0.3 m", "0.4"}},
      {"joint_motion.points=[{ time = 1, joints_deg = { elbow = 121 } }]",
       {"joint_motion.points[0].joints_deg", "\"elbow\" must be from -120 to 120 degrees", "121"}},
      {"joint_motion.points=[{ time = 1, joints_deg = { lift = 1 } }]", {"\"lift\" is prismatic", "_deg"}},
      {"joint_motion.points=[{ time = 1, joints = { turn = 1 } }, { time = 1, joints = { turn = 0 } }]",
       {"joint_motion.points[1].time", "greater"}},
      {"joint_motion.points=[{ time = 1 }]", {"joint_motion.points[0]", "missing key \"joints_deg\""}},
      {"joint_motion.oscillations=[{ joint = 'wrist', amplitude = 1, frequency = 1 }]",
       {"oscillations[0].joint", "wrist"}},
      {"joint_motion.oscillations=[{ joint = 'turn', amplitude = 1, frequency = -1 }]", {"frequency", "-1"}},
      {"control.natural_frequency={ turn = 1, lift = 2 }", {"control.natural_frequency", "\"elbow\""}},
      {"control.natural_frequency=-1", {"control.natural_frequency", "-1"}},
      {"control.stiffness=100", {"control.stiffness", "computed_torque"}},
      {"control.law=impedance", {"control.law", "impedance"}},
      {"expect.position=1e-3", {"expect.position"}},
      {"start=moving", {"start", "rest"}},
      {"grasp={ frame = 'x' }", {"joint_motion", "grasp"}},
  };
  for (const Case& one : cases) EXPECT_TRUE(IsRefused(RunWith(one.assignment), one.parts)) << one.assignment;
}

}  // namespace
}  // namespace dexcheck::testing::own_arm_test
