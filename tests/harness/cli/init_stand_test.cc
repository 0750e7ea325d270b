// dexcheck init of what floats: on which feet, and how, it stands.

#include <algorithm>
#include <sstream>
#include <string>

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

// With straight knees a body can only rise.
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
  // Legs with too few joints cannot move the body in all ways, and a robot on cylinders has no feet.
  std::string stiff = ReadFixture("biped.xml");
  for (const std::string side : {"left", "right"})
    stiff = ReplaceOnce(stiff, "<joint name=\"" + side + "_ankle_roll\" axis=\"1 0 0\"/>", "");
  Write("stiff.xml", stiff);
  EXPECT_THAT(Expect(0, "init stiff.xml").err, HasSubstr("base is held: no stance was found, because in no"));
  EXPECT_EQ(RunMotion(0, "stiff").at("verdict"), "pass");
  WriteChanged("round.xml", ReadFixture("biped.xml"), "type=\"box\" size=\"0.07 0.05 0.01\" contype",
               "type=\"cylinder\" size=\"0.07 0.01\" contype");
  EXPECT_THAT(Expect(0, "init round.xml").err, HasSubstr("because 0 places touch the ground"));
  // An ankle nearly as low as the sole is no foot.
  std::string low = ReplaceOnce(ReadFixture("biped.xml"), " range=\"-1 1\"", "");
  for (const std::string side : {"left", "right"}) {
    const std::string foot = "/>\n                <body name=\"" + side + "_foot\">";
    low = ReplaceOnce(low, "size=\"0.03\"" + foot, "size=\"0.055\" contype=\"1\" conaffinity=\"1\"" + foot);
  }
  Write("low.xml", low);
  EXPECT_THAT(Expect(0, "init low.xml").err, Not(HasSubstr("held")));
  EXPECT_THAT(Read("low/motion.toml"), HasSubstr(R"("foot_8"])"));
  EXPECT_EQ(RunMotion(0, "low").at("verdict"), "pass");
}

// Shanks on the ground are no feet.
TEST_F(InitStand, ARobotThatLiesInItsKeyFrameStands) {
  WriteChanged(
      "lies.xml", ReadFixture("biped.xml"), "</worldbody>",
      "</worldbody><keyframe><key qpos=\"0 0 0.5 1 0 0 0 0 0 -1 1.9 0 0 0 0 -1 1.9 0 0\"/></keyframe>");
  EXPECT_THAT(Expect(0, "init lies.xml").err, Not(HasSubstr("held")));
  EXPECT_EQ(RunMotion(0, "lies").at("verdict"), "pass");
}

}  // namespace
}  // namespace dexcheck::testing::init_stand_test
