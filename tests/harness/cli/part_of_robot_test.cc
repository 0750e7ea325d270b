// dexcheck consistency of part of a robot: a gripper that one file has, a base that one welds, joints that
// are held.

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::part_of_robot_test {
namespace {

class PartOfRobot : public CommandTest {
 protected:
  PartOfRobot() {
    Write("a.urdf", ReplaceOnce(ReadFixture("pair.urdf"), "</robot>", kGripper));
    Write("b.xml", ReadFixture("pair.xml"));
  }

  const std::string kGripper = R"(<link name="finger"><inertial><origin xyz="0.02 0 0"/><mass value="0.1"/>
<inertia ixx="1e-4" iyy="2e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="grip" type="prismatic"><parent link="lower"/><child link="finger"/><origin xyz="0.25 0 0"/>
<axis xyz="0 0 1"/><limit lower="0" upper="0.04" effort="1" velocity="1"/></joint></robot>)";
};

TEST_F(PartOfRobot, TheCommonPartIsComparedAndSaid) {
  const Json results = Compare(0, "a.urdf", "b.xml");
  EXPECT_THAT(results.at("not_compared"), Contains(AllOf(HasSubstr("left out"), HasSubstr("finger"))));
  EXPECT_GT(results.at("checks").at("M_bar").at("compared"), 0);
  // Where the other file has its mass, the joint is held.
  WriteChanged(
      "welded.xml", ReadFixture("pair.xml"), "diaginertia=\"0.01 0.011 0.012\"/>",
      "diaginertia=\"0.01 0.011 0.012\"/><body pos=\"0.25 0 0\"><inertial pos=\"0.02 0 0\" mass=\"0.1\" "
      "diaginertia=\"1e-4 2e-4 2e-4\"/></body>");
  EXPECT_THAT(Compare(0, "a.urdf", "welded.xml").at("not_compared"),
              Contains(AllOf(HasSubstr("held"), HasSubstr("grip at 0"))));
  Compare(0, "a.urdf", "welded.xml", "--lock grip");
  EXPECT_FALSE(Compare(1, "a.urdf", "welded.xml", "--lock grip=0.03").at("checks").at("link_com").at("pass"));
  EXPECT_FALSE(Compare(1, "a.urdf", "welded.xml", "--ignore finger").at("checks").at("link_mass").at("pass"));
  // What is wrong in the common part is found.
  WriteChanged("wrong.urdf", Read("a.urdf"), "value=\"0.8\"", "value=\"0.9\"");
  EXPECT_TRUE(HasFinding(Compare(1, "wrong.urdf", "b.xml"), "link_mass", "link lower", 0.9, 0.8));
}

TEST_F(PartOfRobot, ABaseThatOneFileWeldsIsHeld) {
  const std::string body =
      ReplaceOnce(ReadFixture("pair.xml"), "<body name=\"upper\" pos=\"0 0 0.1\">",
                  "<body name=\"stand\" pos=\"0 0 1\"><freejoint/><inertial pos=\"0 0 0\" mass=\"1\" "
                  "diaginertia=\"1 1 1\"/><body name=\"upper\" pos=\"0 0 0.1\">");
  const std::string floats = ReplaceOnce(body, "  </worldbody>", "</body></worldbody>");
  Write("floats.xml", floats);
  Write("welded.xml", ReplaceOnce(floats, "<freejoint/>", ""));
  const Json results = Compare(0, "welded.xml", "floats.xml");
  EXPECT_THAT(results.at("not_compared"), Contains(HasSubstr("base")));
}

TEST_F(PartOfRobot, OneSubtreeIsCompared) {
  WriteChanged("wrong.urdf", Read("a.urdf"), "value=\"1.5\"", "value=\"1.6\"");
  Compare(1, "wrong.urdf", "b.xml");
  for (const char* only : {"lower", "elbow"})
    Compare(0, "wrong.urdf", "b.xml", Words{"--only", only, "--ignore", "finger"});
  Compare(0, "wrong.urdf", "b.xml", "--ignore finger --lock shoulder=0.3");
  Compare(1, "wrong.urdf", "b.xml", "--ignore finger --lock elbow=0.3");
}

TEST_F(PartOfRobot, WhatIsNotThereIsRefused) {
  for (const char* option : {"--only nothing", "--lock nothing", "--ignore nothing"})
    EXPECT_TRUE(Refused("consistency a.urdf b.xml " + std::string(option), {"nothing", "a.urdf", "b.xml"}))
        << option;
  EXPECT_TRUE(Refused("consistency a.urdf b.xml --lock grip=wide", {"--lock", "grip=wide"}));
  EXPECT_TRUE(
      Refused("consistency a.urdf b.xml --ignore finger --lock shoulder --lock elbow", {"nothing is left"}));
  EXPECT_TRUE(Refused("consistency a.urdf --program cat --only lower", {"--only", "two files"}));
}

TEST_F(PartOfRobot, TwoNamesOfOneJointAreMatchedByStructure) {
  WriteChanged("named.xml", Read("b.xml"), "name=\"elbow\"", "name=\"wrist\"");
  Copy("pair.urdf");
  Compare(0, "pair.urdf", "named.xml");
}

}  // namespace
}  // namespace dexcheck::testing::part_of_robot_test
