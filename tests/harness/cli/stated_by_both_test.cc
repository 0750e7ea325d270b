// dexcheck consistency of what no term shows: what a compiler changed, limits of motors, wheels, options,
// shapes, joints that one file lacks; and robots all of which lies at one point, against themselves.

#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::stated_by_both_test {
namespace {

class StatedByBoth : public CommandTest {
 protected:
  StatedByBoth() {
    Write("a.urdf", kUrdf);
    Write("b.xml", kPair);
  }

  /// The last finding of a check; null when there is none.
  [[nodiscard]] static Json Find(const Json& results, const std::string& check) {
    Json found;
    for (const Json& finding : results.at("findings")) {
      if (finding.at("check") == check) found = finding;
    }
    return found;
  }
  /// The pair's MJCF with motors of the elbow, and one of the shoulder.
  [[nodiscard]] std::string WithMotors(const std::string& motors) const {
    return ReplaceOnce(kPair, "</mujoco>",
                       "<actuator>" + motors + "<motor name='s' joint='shoulder'/></actuator></mujoco>");
  }

  const std::string kUrdf = ReadFixture("pair.urdf");
  const std::string kPair = ReadFixture("pair.xml");
};

// A setting acts on one link of the MJCF, whose text is what the URDF says.
TEST_F(StatedByBoth, WhatACompilerChangedIsADisagreementThatNamesItsSetting) {
  struct Setting {
    const char* attribute;
    const char* check;
    const char* name;
    double stated, made;
  };
  for (const Setting& setting :
       {Setting{"boundmass='1'", "link_mass", "boundmass of c.xml", 0.8, 1.0},
        {"boundinertia='0.0105'", "compiled_inertia", "boundinertia of c.xml", 0.01, 0.0105},
        {"settotalmass='4.6'", "link_mass", "settotalmass of c.xml", 0.8, 1.6}}) {
    SCOPED_TRACE(setting.attribute);
    WriteChanged("c.xml", kPair, "angle=\"radian\"", "angle=\"radian\" " + std::string(setting.attribute));
    const Json finding = Find(Compare(1, "a.urdf", "c.xml"), setting.check);
    ASSERT_FALSE(finding.is_null());
    EXPECT_NEAR(finding.at("model"), setting.stated, 1e-9);
    EXPECT_NEAR(finding.at("engine"), setting.made, 1e-9);
    EXPECT_THAT(finding.at("effect"), HasSubstr(setting.name));
    // The order of two MJCFs does not matter.
    const Json reversed = Find(Compare(1, "c.xml", "b.xml"), setting.check);
    ASSERT_FALSE(reversed.is_null());
    EXPECT_NEAR(reversed.at("model"), setting.made, 1e-9);
    EXPECT_THAT(reversed.at("effect"), HasSubstr(setting.name));
    EXPECT_THAT(Compare(0, "c.xml", "c.xml").at("notes"), Contains(HasSubstr(setting.name)));
  }
}

// Moments 0.01, 0.011, 0.03 cannot be a body's; all become their mean, as a tensor or as moments.
TEST_F(StatedByBoth, ABalancedInertiaIsNotForgiven) {
  WriteChanged("a.urdf", kUrdf, "izz=\"0.012\"", "izz=\"0.03\"");
  for (const char* const inertia :
       {"fullinertia=\"0.01 0.011 0.03 0 0 0\"", "diaginertia=\"0.01 0.011 0.03\""}) {
    SCOPED_TRACE(inertia);
    WriteChanged("c.xml", ReplaceOnce(kPair, "diaginertia=\"0.01 0.011 0.012\"", inertia), "angle=\"radian\"",
                 "angle=\"radian\" balanceinertia=\"true\"");
    const Json results = Compare(1, "a.urdf", "c.xml");
    const Json finding = Find(results, "compiled_inertia");
    ASSERT_FALSE(finding.is_null());
    EXPECT_THAT(finding.at("where"), HasSubstr("lower"));
    EXPECT_NEAR(finding.at("engine"), 0.017, 1e-12);
    EXPECT_THAT(finding.at("effect"), HasSubstr("balanceinertia of c.xml"));
    EXPECT_FALSE(results.at("checks").at("link_inertia").at("pass"));
  }
}

// Efforts of pair.urdf are 1 N m.
TEST_F(StatedByBoth, LimitsOfMotorsAreComparedWhereBothStateThem) {
  for (const char* const same :
       {"<motor joint='elbow' ctrllimited='true' ctrlrange='-1 1'/>",
        "<motor joint='elbow' gear='50' ctrllimited='true' ctrlrange='-0.02 0.02'/>",
        "<position joint='elbow' kp='3' ctrllimited='true' ctrlrange='-2 2' forcelimited='true' "
        "forcerange='-1 1'/>",
        "<motor joint='elbow'/>"}) {
    Write("c.xml", WithMotors(same));
    Compare(0, "a.urdf", "c.xml");
  }
  for (const auto& [other, limit] :
       {std::pair("<motor joint='elbow' ctrllimited='true' ctrlrange='-1 1' forcelimited='true' "
                  "forcerange='-0.4 0.4'/>",
                  0.4),
        {"<motor joint='elbow' ctrllimited='true' ctrlrange='-2 2'/>", 2.0},
        {"<motor joint='elbow' gear='1.01' ctrllimited='true' ctrlrange='-1 1'/>", 1.01},
        {"<position joint='elbow' kp='3' forcelimited='true' forcerange='-3 3'/>", 3.0}}) {
    SCOPED_TRACE(other);
    Write("c.xml", WithMotors(other));
    EXPECT_TRUE(
        HasFinding(Compare(1, "a.urdf", "c.xml"), "motor_limit", "joint elbow on link upper", 1.0, limit));
    Compare(0, "a.urdf", "c.xml", "--ignore effort");
  }
  // A joint's own limit, which this engine does not know.
  WriteChanged("c.xml", kPair, "name=\"elbow\"", "name=\"elbow\" actuatorfrcrange=\"-0.6 0.6\"");
  const Json later = Compare(1, "a.urdf", "c.xml");
  ASSERT_EQ(later.at("causes").size(), 1U);
  EXPECT_EQ(later.at("causes")[0].at("text"),
            "joint elbow: effort limit differs: 1 N m here, 0.6 N m in the other file");
  // Two URDFs.
  WriteChanged("c.urdf", kUrdf, "upper=\"1\" effort=\"1\"", "upper=\"1\" effort=\"1.2\"");
  EXPECT_TRUE(
      HasFinding(Compare(1, "a.urdf", "c.urdf"), "motor_limit", "joint elbow on link upper", 1.0, 1.2));
  // No effort is no statement.
  WriteChanged("c.urdf", kUrdf, "upper=\"1\" effort=\"1\"", "upper=\"1\" effort=\"0\"");
  Compare(0, "a.urdf", "c.urdf");
}

TEST_F(StatedByBoth, MotorsOfTwoMjcfsAreCompared) {
  Write("c.xml", WithMotors("<motor name='m' joint='elbow' ctrllimited='true' ctrlrange='-1 1'/>"));
  for (const auto& [other, check] :
       {std::pair("<motor name='m' joint='elbow' ctrllimited='true' ctrlrange='-1 2'/>", "motor_limit"),
        {"<motor name='m' joint='elbow'/>", "motor_limit"},
        {"<motor name='m' joint='elbow' ctrllimited='true' ctrlrange='-1 1' gear='-1'/>",
         "motor_transmission"},
        {"<motor name='m' joint='elbow' ctrllimited='true' ctrlrange='-1 1' gear='1.01'/>",
         "motor_transmission"}}) {
    SCOPED_TRACE(other);
    Write("d.xml", WithMotors(other));
    EXPECT_FALSE(Find(Compare(1, "c.xml", "d.xml"), check).is_null());
    Compare(0, "d.xml", "d.xml");
  }
  EXPECT_THAT(Compare(0, "c.xml", "b.xml").at("not_compared"),
              Contains(HasSubstr("motors only in c.xml: m, s")));
}

// A gear is told beside a URDF, which has none, and contradicts a parameter file, whose torques are controls.
TEST_F(StatedByBoth, AMotorThatIsMissingIsACause) {
  Write("c.xml", ReplaceOnce(kPair, "</mujoco>", "<actuator><motor joint='elbow'/></actuator></mujoco>"));
  Write("d.xml", WithMotors("<motor joint='elbow'/>"));
  const Json causes = Compare(1, "c.xml", "d.xml").at("causes");
  ASSERT_EQ(causes.size(), 1U) << causes;
  EXPECT_EQ(causes[0].at("id"), "gear.missing");
  EXPECT_EQ(causes[0].at("places"), Json({"joint shoulder"}));
}

TEST_F(StatedByBoth, ARangeThatOneFileLacksIsACause) {
  WriteChanged("c.xml", kPair, "limited=\"true\" range=\"-1 1\"", "");
  for (const auto& [a, b, id] :
       {std::tuple("a.urdf", "c.xml", "range.unneeded"), std::tuple("c.xml", "a.urdf", "range.missing")}) {
    const Json causes = Compare(1, a, b).at("causes");
    ASSERT_EQ(causes.size(), 1U) << causes;
    EXPECT_EQ(causes[0].at("id"), id);
  }
}

TEST_F(StatedByBoth, AGearIsNeverSilent) {
  Expect(0, "import a.urdf --out a.toml");
  for (const char* const gear : {"-1", "1.01"}) {
    Write("c.xml", WithMotors("<motor name='m' joint='elbow' gear='" + std::string(gear) + "'/>"));
    const bool turns_back = gear[0] == '-';
    const Json results = Compare(turns_back ? 1 : 0, "a.urdf", "c.xml");
    EXPECT_THAT(results.at("not_compared"), Contains(HasSubstr("m (gear " + std::string(gear) + ")")));
    EXPECT_EQ(results.at("causes").size(), turns_back ? 1U : 0U);
    if (turns_back) EXPECT_EQ(results.at("causes")[0].at("id"), "gear.sign");
    EXPECT_TRUE(
        HasFinding(Compare(1, "a.toml", "c.xml"), "motor_transmission", "actuator m", 1.0, std::stod(gear)));
  }
}

TEST_F(StatedByBoth, AJointOfAnotherTypeIsADisagreement) {
  WriteChanged("c.urdf", kUrdf, "name=\"elbow\" type=\"revolute\"", "name=\"elbow\" type=\"prismatic\"");
  for (const char* other : {"a.urdf", "b.xml"}) {
    const Json causes = Compare(1, "c.urdf", other).at("causes");
    ASSERT_EQ(causes.size(), 1U) << causes;
    EXPECT_EQ(causes[0].at("id"), "number.type");
    EXPECT_EQ(causes[0].at("places"), Json({"joint elbow"}));
    EXPECT_THAT(causes[0].at("text"), HasSubstr("prismatic here, revolute in the other file"));
  }
}

// No term depends on them, so they are listed besides.
TEST_F(StatedByBoth, VelocityLimitsAndABaseThatDoesNotMoveAreCauses) {
  WriteChanged("c.urdf", kUrdf, "upper=\"2\" effort=\"1\" velocity=\"1\"",
               "upper=\"2\" effort=\"1\" velocity=\"1.5\"");
  EXPECT_EQ(Compare(1, "a.urdf", "c.urdf").at("without_effect"),
            Json::array({"velocity limits: shoulder (1 against 1.5)"}));
  const auto with_stand = [&](const std::string& name, const std::string& mass, const std::string& x) {
    WriteChanged(name, kUrdf, "<link name=\"stand\"/>",
                 "<link name=\"stand\"><inertial><origin xyz=\"" + x + " 0 0\"/><mass value=\"" + mass +
                     "\"/><inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" "
                     "iyz=\"0\"/></inertial></link>");
  };
  with_stand("d.urdf", "4", "0");
  with_stand("e.urdf", "4.1", "0");
  with_stand("f.urdf", "4", "0.01");
  const std::string base = "base with all that is welded to it: ";
  EXPECT_EQ(Compare(1, "d.urdf", "e.urdf").at("without_effect"),
            Json::array({base + "mass 4 against 4.1 kg"}));
  EXPECT_EQ(Compare(1, "d.urdf", "f.urdf").at("without_effect"),
            Json::array({base + "centre of mass, 0.01 m apart"}));
  EXPECT_EQ(Compare(0, "d.urdf", "d.urdf").at("without_effect"), Json::array());
}

TEST_F(StatedByBoth, OptionsThatActOnNoTermAreListedAndCounted) {
  for (const auto& [option, line] :
       {std::pair("cone='elliptic'", "option cone: pyramidal in b.xml, elliptic in c.xml"),
        {"impratio='10'", "option impratio: 1 in b.xml, 10 in c.xml"},
        {"solver='PGS'", "option solver: Newton in b.xml, PGS in c.xml"},
        {"timestep='0.001'", "option timestep: 0.002 in b.xml, 0.001 in c.xml"},
        {"o_solref='0.01 1'", "option o_solref: 0.02 1 in b.xml, 0.01 1 in c.xml"}}) {
    WriteChanged("c.xml", kPair, "<worldbody>", "<option " + std::string(option) + "/><worldbody>");
    EXPECT_EQ(Compare(0, "b.xml", "c.xml").at("without_effect"), Json::array({line}));
    EXPECT_THAT(Expect(0, "consistency b.xml c.xml --samples 20 --quiet").out,
                ::testing::ContainsRegex("differs without\\s+effect on these terms\\s+\\(option "));
  }
  EXPECT_EQ(Compare(0, "b.xml", "b.xml").at("without_effect"), Json::array());
  // Contacts.
  const std::string ball =
      "<geom name='ball' size='0.05' mass='0' friction='1 0.005 0.0001'/></body>\n    </body>";
  const std::string with = ReplaceOnce(kPair, "</body>\n    </body>", ball);
  Write("c.xml", with);
  WriteChanged("d.xml", with, "friction='1 ", "friction='0.7 ");
  EXPECT_THAT(Compare(0, "c.xml", "d.xml").at("without_effect"), Contains(HasSubstr("geom ball")));
}

// A cart: a base that floats and a wheel, whose radius no term has.
TEST_F(StatedByBoth, TheRadiusOfAWheelIsCompared) {
  const std::string inertia = "<inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/>";
  const std::string cart = "<robot name='cart'><link name='cart'><inertial><mass value='5'/>" + inertia +
                           "</inertial></link><link name='wheel'><inertial><mass value='1'/>" + inertia +
                           "</inertial><collision><origin rpy='1.5707963267948966 0 0'/><geometry><cylinder "
                           "radius='0.1' length='0.04'/></geometry></collision></link>"
                           "<joint name='roll' type='continuous'><parent link='cart'/><child link='wheel'/>"
                           "<origin xyz='0 0.2 0'/><axis xyz='0 1 0'/></joint></robot>";
  Write("cart.urdf", cart);
  const std::string scene =
      "<mujoco><worldbody><body name='cart'><freejoint/><inertial pos='0 0 0' mass='5' "
      "diaginertia='0.01 0.01 0.01'/><body name='wheel' pos='0 0.2 0'><joint name='roll' "
      "axis='0 1 0'/><inertial pos='0 0 0' mass='1' diaginertia='0.01 0.01 0.01'/>"
      "<geom type='cylinder' size='0.1 0.02' euler='90 0 0'/></body></body></worldbody></mujoco>";
  Write("cart.xml", scene);
  EXPECT_EQ(Compare(0, "cart.urdf", "cart.xml").at("without_effect"), Json::array());
  WriteChanged("other.xml", scene, "size='0.1 0.02'", "size='0.12 0.02'");
  EXPECT_TRUE(
      HasFinding(Compare(1, "cart.urdf", "other.xml"), "wheel_radius", "joint roll on link cart", 0.1, 0.12));
  WriteChanged("other.urdf", cart, "radius='0.1'", "radius='0.08'");
  EXPECT_TRUE(HasFinding(Compare(1, "other.urdf", "cart.urdf", "--floating"), "wheel_radius",
                         "joint roll on link cart", 0.08, 0.1));
  // The shape of a link that is no wheel is listed.
  WriteChanged("other.xml", scene, "size='0.1 0.02'", "size='0.1 0.03'");
  EXPECT_THAT(Compare(0, "cart.urdf", "other.xml").at("without_effect"), Contains(HasSubstr("shapes")));
}

// A joint that one file has not, at the end, whichever file it is.
TEST_F(StatedByBoth, AJointThatOneFileLacksIsADisagreementUntilItIsIgnored) {
  const auto with_tip = [&](const std::string& mass) {
    return ReplaceOnce(
        kUrdf, "</robot>",
        "<link name='tip'><inertial><origin xyz='0.02 0 0'/><mass value='" + mass +
            "'/><inertia ixx='1e-4' iyy='2e-4' izz='2e-4' ixy='0' ixz='0' iyz='0'/></inertial>"
            "</link><joint name='grip' type='prismatic'><parent link='lower'/><child link='tip'/>"
            "<origin xyz='0.25 0 0'/><axis xyz='0 0 1'/><limit lower='0' upper='0.04' "
            "effort='1' velocity='1'/></joint></robot>");
  };
  Write("tip.urdf", with_tip("0.1"));
  for (const char* const other : {"a.urdf", "b.xml"}) {
    SCOPED_TRACE(other);
    const Json causes = Compare(1, "tip.urdf", other).at("causes");
    ASSERT_EQ(causes.size(), 1U) << causes;
    EXPECT_THAT(causes[0].at("text"),
                AllOf(HasSubstr("joint grip: joint not in the other file"), HasSubstr("link tip")));
    Compare(0, "tip.urdf", other, "--ignore tip");
    Compare(1, other, "tip.urdf");
    EXPECT_THAT(Expect(1, {"tip.urdf", other}).out, HasSubstr("joint grip"));
  }
  // A frame that has no mass is a note.
  WriteChanged(
      "frame.urdf", kUrdf, "</robot>",
      "<link name='tool'/><joint name='mount' type='fixed'><parent link='lower'/><child link='tool'/>"
      "</joint></robot>");
  EXPECT_THAT(Compare(0, "frame.urdf", "a.urdf").at("not_compared"), Contains(HasSubstr("tool")));
}

TEST_F(StatedByBoth, WhatIsIgnoredIsNoLikelyCause) {
  const std::string damped =
      ReplaceOnce(kUrdf, "upper=\"1\" effort=\"1\" velocity=\"1\"/>",
                  "upper=\"1\" effort=\"1\" velocity=\"1\"/><dynamics damping=\"0.5\"/>");
  Write("damped.urdf", ReplaceOnce(damped, "value=\"0.8\"", "value=\"0.0008\""));
  WriteChanged("right.urdf", damped, "damping=\"0.5\"", "damping=\"0.00872664625997165\"");
  const auto list = [](const Json& results) {
    std::string text;
    for (const Json& one : results.at("causes")) text += one.at("text").get<std::string>() + "\n";
    return text;
  };
  EXPECT_THAT(list(Compare(1, "damped.urdf", "right.urdf")), HasSubstr("damping"));
  EXPECT_THAT(list(Compare(1, "damped.urdf", "right.urdf", "--ignore damping")), Not(HasSubstr("damping")));
}

// A convention of joints' places explains nothing where axes, frames and Jacobians agree.
TEST_F(StatedByBoth, PlacesThatAgreeAreNoLikelyCause) {
  const std::string far = ReplaceOnce(
      kUrdf, "</robot>",
      "<link name='far'/><joint name='mount' type='fixed'><parent link='lower'/><child link='far'/>"
      "<origin xyz='2 0 0'/></joint></robot>");
  Write("right.urdf", ReplaceOnce(far, "xyz=\"0.3 0 0\"", "xyz=\"0.3 -0.0008 0\""));
  const std::string moved = ReplaceOnce(far, "xyz=\"0.3 0 0\"", "xyz=\"0.3 0.0008 0\"");
  Write("wrong.urdf", ReplaceOnce(moved, "value=\"0.8\"", "value=\"0.9\""));
  const Json causes = Compare(1, "wrong.urdf", "right.urdf", "--digits 3").at("causes");
  ASSERT_EQ(causes.size(), 1U) << causes;
  EXPECT_EQ(causes[0].at("id"), "number.mass");
  EXPECT_EQ(Compare(1, "wrong.urdf", "right.urdf", "--exact").at("causes").size(), 2U);
}

// 0.3 mm, divided by 1000, is near 0 as it is near any number.
TEST_F(StatedByBoth, AUnitIsNoLikelyCauseWhereTheRightNumberIsZero) {
  Write("right.urdf", ReplaceOnce(kUrdf, "<origin xyz=\"0.1 0 0\"/>", "<origin xyz=\"0 0 0\"/>"));
  Write("wrong.urdf", ReplaceOnce(kUrdf, "<origin xyz=\"0.1 0 0\"/>", "<origin xyz=\"0.0003 0 0\"/>"));
  const Json results = Compare(1, "wrong.urdf", "right.urdf");
  for (const Json& one : results.at("causes"))
    EXPECT_THAT(one.at("text").get<std::string>(), Not(HasSubstr("mm")));
  // The unit is proposed where it is not the file's.
  Write("wrong.urdf", ReplaceOnce(kUrdf, "<origin xyz=\"0.1 0 0\"/>", "<origin xyz=\"100 0 0\"/>"));
  EXPECT_THAT(Compare(1, "wrong.urdf", "a.urdf").at("causes").at(0).at("text").get<std::string>(),
              HasSubstr("mm"));
}

/// A flywheel: one body on a joint of that kind, its centre of mass there; URDF and MJCF.
struct OnePoint {
  const char* name;
  const char* joints;  ///< Joints of the MJCF.
  double mass, inertia;
};

// An inertia has no arm where all lies at one point, and is compared by its own size.
TEST_F(StatedByBoth, ARobotAtOnePointAgreesWithItself) {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const OnePoint& robot :
         {OnePoint{"flywheel", "<joint name='j0' axis='0 0 1'/>", 2.0, 10.0},
          {"tilted", "<joint name='j0' axis='0.3 -0.2 0.7'/>", 0.5, 40.0},
          {"gimbal", "<joint name='j0' axis='0.3 -0.2 0.7'/><joint name='j1' axis='1 0 0'/>", 3.0, 25.0},
          {"ball", "<joint name='j0' type='ball'/>", 1.0, 7.0}}) {
      SCOPED_TRACE(std::string(robot.name) + " " + std::to_string(scale));
      const auto number = [&](double value) { return std::to_string(value * scale * 1e6) + "e-6"; };
      const std::string text = "<mujoco><compiler boundmass='0'/><worldbody><body name='body'>" +
                               std::string(robot.joints) + "<inertial pos='0 0 0' mass='" +
                               number(robot.mass) + "' fullinertia='" + number(robot.inertia) + " " +
                               number(1.3 * robot.inertia) + " " + number(1.7 * robot.inertia) + " " +
                               number(0.1 * robot.inertia) +
                               " 0 0'/>"
                               "</body></worldbody></mujoco>";
      Write("one.xml", text);
      Compare(0, "one.xml", "one.xml", "--exact");
      Expect(0, "import one.xml --out one.toml");
      Compare(0, "one.toml", "one.xml", "--exact");
      // The scale forgives nothing: an inertia that is 1e-9 larger is found.
      WriteChanged("other.xml", text, number(1.7 * robot.inertia),
                   number(1.7 * robot.inertia * (1.0 + 1e-6)));
      Compare(1, "other.xml", "one.xml", "--exact");
    }
  }
}

}  // namespace
}  // namespace dexcheck::testing::stated_by_both_test
