// An arm of the user's own, from nothing but its MJCF: import, write a scenario, run.

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::own_arm_test {
namespace {

/// files/arm.xml, a turning column, a lift that slides on it, an elbow, with sizes and masses by geoms alone;
/// files/own.toml, a motion of it.
class OwnArm : public CommandTest {
 protected:
  OwnArm() {
    Write("own.toml", kScenario);
    WriteArm({});
  }
  /// Writes the arm with these changes, and its table.
  void WriteArm(const std::vector<Edit>& edits, const std::string& table = "arm.toml") const {
    Write("arm.xml", ApplyEdits(kArm, edits));
    Expect(0, {"import", "arm.xml", "--out", table});
  }
  Json RunArm(int exit_code, const Words& more = "--seed 0") const {
    return RunJson(exit_code, Words("run own.toml --no-log") + more);
  }

  const std::string kArm = ReadFixture("arm.xml");
  const std::string kScenario = ReadFixture("own.toml");
};

TEST_F(OwnArm, IsRunReportedDrawnAndReplayed) {
  Expect(0, "run own.toml --out run");
  const Json summary = ReadJson("run/summary.json");
  EXPECT_EQ(summary.at("verdict"), "pass");
  EXPECT_GT(summary.at("tracking").at("joint_error_max_rad").get<double>(), 0.0);
  EXPECT_FALSE(summary.at("tracking").contains("position_error_max_m"));
  EXPECT_TRUE(summary.at("checks").contains("joint_dynamics"));
  EXPECT_FALSE(summary.at("checks").contains("contact_force"));
  const std::string page = Read("run/report.html");
  for (const char* title : {"Motion of the joints", "Errors of the joints", "Torques of the joints"})
    EXPECT_TRUE(page.find(title) != std::string::npos) << title;
  // Nothing here is in the paper.
  for (const char* papers : {"the paper's figures", "<b>Figure"}) EXPECT_THAT(page, Not(HasSubstr(papers)));
  Expect(0, "render run --still 0.5 --size 320x240 --out picture.png");
  Expect(0, "run --replay run");
}

// Descriptions that were made for dynamics often have no shapes.
TEST_F(OwnArm, WithoutShapesHasAPageToo) {
  const std::string inertial = R"(<inertial pos="0.1 0 0.05" mass="1" diaginertia="0.02 0.02 0.02"/>)";
  WriteArm({{R"(<geom type="cylinder" size="0.05 0.2" mass="3"/>)", inertial},
            {R"(<geom type="box" size="0.1 0.04 0.04" mass="1.5" pos="0.1 0 0"/>)", inertial},
            {R"(<geom type="capsule" size="0.03" fromto="0 0 0 0.3 0 0" mass="0.8"/>)", inertial}});
  EXPECT_EQ(Expect(0, "run own.toml --set duration=0.5 --out run").err, "");
  EXPECT_THAT(Read("run/report.html"), HasSubstr("Robot at the end"));
  Expect(0, "render run --still 0.5 --size 320x240 --out picture.png");
}

TEST_F(OwnArm, RunsWithoutTheEngine) {
  EXPECT_GT(RunArm(0, "--set plant.type=rigid").at("tracking").at("joint_error_max_rad"), 0.0);
}

TEST_F(OwnArm, WithABallJointIsComparedButNotRun) {
  WriteArm({{R"(name="turn" type="hinge" axis="0 0 1" range="-170 170" limited="true" damping="0.1")",
             R"(name="turn" type="ball")"}},
           "ball.toml");
  Expect(0, "consistency ball.toml arm.xml --samples 20");
  EXPECT_TRUE(
      Refused("run own.toml --no-log --set model.file=ball.toml", {"ball.toml", "ball", "turn", "run"}));
}

// The engine's friction that holds a joint, or lets it slide, is known when the parameters state it.
TEST_F(OwnArm, WithDryFrictionIsRun) {
  const std::vector<Edit> friction = {{"damping=\"0.1\"", "damping=\"0.1\" frictionloss=\"0.5\""},
                                      {"armature=\"0.01\"", "frictionloss=\"0.2\""}};
  WriteArm(friction, "with_friction.toml");
  const Json hidden = RunArm(1);
  for (const char* check : {"joint_dry_friction", "inverse_dynamics_robot"})
    EXPECT_EQ(hidden.at("checks").at(check).at("pass"), false) << check;

  WriteArm(friction);
  Expect(0, "run own.toml --no-report --out run --set expect.joints=0.05");
  Expect(0, "run --replay run");
  EXPECT_TRUE(
      Refused("run own.toml --no-log --set plant.type=rigid", {"plant.type", "dry friction", "\"turn\""}));
}

// Rounding puts the fingers of a closed gripper beyond their range, by 2e-19 m here.
TEST_F(OwnArm, AJointMayRestAtTheEndOfItsRange) {
  WriteArm({{"range=\"-0.2 0.3\"", "range=\"0 0.3\""}});
  Write("own.toml", ApplyEdits(kScenario, {{"lift = 0.1, ", ""}, {", lift = -0.1", ""}}));
  EXPECT_EQ(RunArm(0).at("verdict"), "pass");
}

// Most of the MJCFs that are published name one; by it velocities change by other than dt qacc. What implicit
// damping makes of them is predicted for the engine's Euler.
TEST_F(OwnArm, IsSteppedByEulerWhateverItsMjcfSays) {
  const auto damps = [&] { return RunArm(0, "--set plant.implicit_damping=true").at("checks"); };
  WriteArm({});
  EXPECT_TRUE(damps().contains("joint_dynamics"));
  for (const std::string integrator : {"RK4", "implicit"}) {
    WriteArm({{"<worldbody>", "<option integrator=\"" + integrator + "\"/><worldbody>"}});
    EXPECT_EQ(RunArm(0).at("verdict"), "pass") << integrator;
  }
  EXPECT_FALSE(damps().contains("joint_dynamics"));
}

TEST_F(OwnArm, DoesNotPassWithAnotherMass) {
  WriteChanged("arm.xml", kArm, "mass=\"0.8\"", "mass=\"0.9\"");
  const Json summary = RunArm(1);
  EXPECT_EQ(summary.at("checks").at("link_mass").at("pass"), false);
  EXPECT_THAT(summary.at("attribution").at("evidence"), HasSubstr("forearm"));
}

// A number that was rounded when it was printed.
TEST_F(OwnArm, PassesToTheDigitsThatItsNumbersHave) {
  WriteChanged("arm.xml", kArm, "mass=\"0.8\"", "mass=\"0.800004\"");
  EXPECT_EQ(RunArm(0).at("verdict"), "pass");  // 0.8 stands for 0.800
  RunArm(1, "--digits 6");
  RunArm(0, "--tolerance 2e-5");
  RunArm(0, "--set tolerance=2e-5");
  Expect(0, "run own.toml --no-report --digits 5 --out run");
  EXPECT_EQ(ReadJson("run/summary.json").at("checks").at("M_bar").at("bound").get<double>(), 1e-5);
  Expect(0, "run --replay run");
}

}  // namespace
}  // namespace dexcheck::testing::own_arm_test
