// dexcheck init of what floats: on which feet, and how, it stands.

#include <algorithm>
#include <sstream>
#include <string>
#include <tuple>

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::init_stand_test {
namespace {

using InitStand = CommandTest;

// A floating base stands on what is lowest of the robot and can touch.
TEST_F(InitStand, ARobotWithAFloatingBaseStands) {
  Expect(0, {"init", kMjcf + "quadruped_scene.xml", "--out", "dog"});
  EXPECT_THAT(Read("dog/motion.toml"), HasSubstr(R"(feet = ["foot_1", "foot_2", "foot_3", "foot_4"])"));
  const Json run = RunMotion(0, "dog");
  EXPECT_EQ(run.at("verdict"), "pass");
  EXPECT_GT(run.at("checks").at("foot_cone_use").at("max").get<double>(), 0.0);
  // Without places to stand on it is held, and its joints move all the same.
  EXPECT_THAT(Expect(0, {"init", kMjcf + "quadruped.xml", "--out", "held"}).err,
              HasSubstr("base is held: no stance was found, because 0 places touch the ground"));
  EXPECT_THAT(Read("held/robot.xml"), Not(HasSubstr("freejoint")));
  const Json held = RunMotion(0, "held");
  EXPECT_EQ(held.at("verdict"), "pass");
  EXPECT_GT(held.at("tracking").at("joint_error_max_rad").get<double>(), 0.0);
}

// With straight knees a body can only rise. Soles that are no shape of a stance stand on spheres.
TEST_F(InitStand, ABipedBendsItsKneesToStand) {
  Copy("biped.xml");
  EXPECT_THAT(Expect(0, "init biped.xml").err, Not(HasSubstr("held")));
  const std::string motion = Read("biped/motion.toml");
  EXPECT_THAT(motion, HasSubstr(R"("foot_8"])"));
  const double knee = std::stod(motion.substr(motion.find("\"left_knee\" = ") + 14));
  EXPECT_GT(knee, 0.1);
  const Json run = RunJson(0, {"run", "biped/motion.toml", "--out", "stood", "--set", "settle=0.1"});
  EXPECT_EQ(run.at("verdict"), "pass");
  // How a foot's four contacts share its load is not determined: the use is the foot's, not theirs.
  const double use = run.at("checks").at("foot_cone_use").at("max").get<double>();
  EXPECT_GT(use, 0.0);
  std::istringstream rows(Expect(0, "export stood --csv - --signals foot/cone_use").out);
  double most = 0.0;
  std::string row, cell;
  for (std::getline(rows, row); std::getline(rows, row);) {
    for (std::istringstream cells(row); std::getline(cells, cell, ',');)
      most = std::max(most, std::stod(cell));
  }
  EXPECT_GT(most, 1.5 * use);
  // Legs with too few joints move the body in its plane alone.
  std::string stiff = ReadFixture("biped.xml");
  for (const std::string side : {"left", "right"}) {
    const std::string roll = "<joint name=\"" + side + "_ankle_roll\" axis=\"1 0 0\"/>";
    ASSERT_NE(stiff.find(roll), std::string::npos);
    stiff.erase(stiff.find(roll), roll.size());
  }
  Write("stiff.xml", stiff);
  EXPECT_THAT(Expect(0, "init stiff.xml").err, Not(HasSubstr("held")));
  EXPECT_THAT(Read("stiff/motion.toml"), HasSubstr("rpy_deg = [0, 0, 0]"));
  EXPECT_EQ(RunMotion(0, "stiff").at("verdict"), "pass");
  // An ankle nearly as low as the sole is no foot; a stretched leg whose joints have no ranges bends, too.
  std::string low = ReplaceOnce(ReadFixture("biped.xml"), " range=\"-1 1\"", "");
  for (const std::string side : {"left", "right"}) {
    const std::string foot = "/>\n                <body name=\"" + side + "_foot\">";
    low = ReplaceOnce(low, side + "_knee\" range=\"0 2\"", side + "_knee\"");
    low = ReplaceOnce(low, "size=\"0.03\"" + foot, "size=\"0.055\" contype=\"1\" conaffinity=\"1\"" + foot);
  }
  Write("low.xml", low);
  EXPECT_THAT(Expect(0, "init low.xml").err, Not(HasSubstr("held")));
  EXPECT_THAT(Read("low/motion.toml"), HasSubstr(R"("foot_8"])"));
  EXPECT_EQ(RunMotion(0, "low").at("verdict"), "pass");
  // An ankle without limits is no wheel, on which it would roll away.
  const std::string ankle = "<joint name=\"left_ankle_roll\"";
  WriteChanged("free.xml", ReadFixture("biped.xml"), ankle, ankle + " limited=\"false\"");
  EXPECT_THAT(Expect(0, "init free.xml").err, Not(HasSubstr("held")));
  const std::string sole = "/>\n                  <geom class=\"sole\" ";
  WriteChanged("rolls.xml", ReadFixture("biped.xml"),
               ankle + " axis=\"1 0 0\"" + sole + "pos=\"0.02 0 -0.06\"",
               ankle + " limited=\"false\"" + sole + "zaxis=\"0 1 0\"");
  EXPECT_THAT(Expect(0, "init rolls.xml").err, HasSubstr("because a foot turns without end, as wheels do"));
}

// Shanks on the ground are no feet.
TEST_F(InitStand, ARobotThatLiesInItsKeyFrameStands) {
  WriteChanged(
      "lies.xml", ReadFixture("biped.xml"), "</worldbody>",
      "</worldbody><keyframe><key qpos=\"0 0 0.5 1 0 0 0 0 0 -1 1.9 0 0 0 0 -1 1.9 0 0\"/></keyframe>");
  EXPECT_THAT(Expect(0, "init lies.xml").err, Not(HasSubstr("held")));
  EXPECT_EQ(RunMotion(0, "lies").at("verdict"), "pass");
}

/// A URDF of a trunk on four legs of three joints, with a ball for a foot.
std::string MakeLeggedUrdf(const std::string& head) {
  const auto link = [](const std::string& name, double mass, const std::string& more) {
    return "<link name=\"" + name + "\"><inertial><mass value=\"" + std::to_string(mass) +
           "\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>" +
           more + "</link>\n";
  };
  std::string text = "<robot name=\"legged\">\n" + head + link("trunk", 8.0, "");
  for (const char* leg : {"0.2 0.1", "0.2 -0.1", "-0.2 0.1", "-0.2 -0.1"}) {
    const std::string name = leg;
    std::string parent = "trunk", place = name + " 0";
    for (const auto& [part, axis, next] : {std::tuple("hip", "1 0 0", "0 0 0"),
                                           {"thigh", "0 1 0", "0 0 -0.2"},
                                           {"shank", "0 1 0", "0 0 -0.2"}}) {
      const bool ends = std::string(part) == "shank";
      text += link(part + name, 0.5,
                   ends ? "<collision><origin xyz=\"0 0 -0.2\"/><geometry><sphere "
                          "radius=\"0.02\"/></geometry></collision>"
                        : "");
      text += "<joint name=\"" + (part + name) + "\" type=\"revolute\"><parent link=\"" + parent +
              "\"/><child link=\"" + part + name + "\"/><origin xyz=\"" + place + "\"/><axis xyz=\"" + axis +
              "\"/><limit lower=\"" + (ends ? "-2.5" : "-1") + "\" upper=\"" + (ends ? "0" : "1.5") +
              "\" effort=\"40\" velocity=\"10\"/></joint>\n";
      parent = part + name;
      place = next;
    }
  }
  return text + "</robot>\n";
}

// A URDF does not say that its base floats: legs do.
TEST_F(InitStand, AUrdfWithLegsAloneStands) {
  Write("legged.urdf", MakeLeggedUrdf(""));
  const ProgramResult said = Expect(0, "init legged.urdf");
  EXPECT_THAT(said.err, HasSubstr("floats, on 4 legs"));
  EXPECT_THAT(said.err, Not(HasSubstr("held")));
  EXPECT_THAT(said.out, HasSubstr("wrong in both"));
  EXPECT_THAT(Read("legged/robot.xml"), HasSubstr("freejoint"));
  EXPECT_THAT(Read("legged/motion.toml"), HasSubstr(R"(feet = ["foot_1", "foot_2", "foot_3", "foot_4"])"));
  const Json run = RunJson(0, {"run", "legged/motion.toml", "--no-log", "--set", "settle=0.1"});
  EXPECT_EQ(run.at("verdict"), "pass");
  EXPECT_GT(run.at("checks").at("foot_cone_use").at("max").get<double>(), 0.0);
  // What hangs on the world does not.
  Write("hangs.urdf", MakeLeggedUrdf("<link name=\"world\"/><joint name=\"weld\" type=\"fixed\">"
                                     "<parent link=\"world\"/><child link=\"trunk\"/></joint>\n"));
  EXPECT_THAT(Expect(0, "init hangs.urdf").err, Not(HasSubstr("floats")));
  EXPECT_THAT(Read("hangs/motion.toml"), HasSubstr("[joint_motion]\nstart"));
}

}  // namespace
}  // namespace dexcheck::testing::init_stand_test
