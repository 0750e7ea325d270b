// Parts of two MJCFs besides the mechanism (motors, springs, tendons, constraints, flags), compared with each
// other; and motors beside a URDF.

#include "harness/comparison/engine_parts.h"

#include <gmock/gmock.h>

#include <regex>

#include "harness/comparison/file_differences.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"

namespace dexcheck::testing::engine_parts_test {
namespace {

constexpr const char* kArm = R"(<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option gravity="0 0 -9.81"/>
  <default><joint damping="0.3" armature="0.01" range="-1 1" limited="true"/></default>
  <worldbody>
    <body name="upper"><joint name="shoulder" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/>
      <body name="fore" pos="0.3 0 0"><joint name="elbow" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.025"/>
      </body>
    </body>
  </worldbody>
</mujoco>
)";

/// An arm with something besides its mechanism; the same with another number; the check that sees it.
struct Extra {
  const char* name;
  const char* at;  // where the text stands instead
  const char* text;
  const char* other;
  const char* check;
};
void PrintTo(const Extra& extra, std::ostream* stream) { *stream << extra.name; }

class TwoMjcfs : public ::testing::TestWithParam<Extra> {
 protected:
  Comparison Compare(const std::string& a, const std::string& b) {
    WriteText(folder_.path() / "a.xml", a);
    WriteText(folder_.path() / "b.xml", b);
    ConsistencyOptions options;
    options.samples = 5;
    return CompareFiles(folder_.path() / "a.xml", folder_.path() / "b.xml", {}, options);
  }

  static std::string List(const Comparison& comparison) {
    std::string text;
    for (const std::string& line : ListDifferences(comparison)) text += line + "\n";
    return text;
  }

  TempFolder folder_;
};

TEST_P(TwoMjcfs, AreComparedInWhatTheyHaveBesidesTheMechanism) {
  const Extra& extra = GetParam();
  const std::string plain = kArm;
  const std::string with = ReplaceOnce(plain, extra.at, extra.text);
  const std::string changed = ReplaceOnce(plain, extra.at, extra.other);
  const Comparison same = Compare(with, with);
  EXPECT_TRUE(same.result.Agrees()) << List(same);
  EXPECT_EQ(List(same), "");
  for (const auto& [a, b] : {std::pair(with, plain), std::pair(plain, with), std::pair(with, changed)}) {
    const Comparison different = Compare(a, b);
    EXPECT_FALSE(different.result.Agrees());
    EXPECT_NE(List(different), "");
    EXPECT_NE(std::ranges::find(different.result.constants.findings, extra.check, &ConstantFinding::check),
              different.result.constants.findings.end())
        << List(different);
    for (const ConstantFinding& finding : different.result.constants.findings) {
      EXPECT_NE(finding.model, finding.engine) << finding.check;
    }
    for (const CheckRecord& record : different.result.constants.records) {
      if (record.name == extra.check) EXPECT_TRUE(record.failed);
    }
  }
}

const char* const kEnd = "</mujoco>";
const char* const kGravity = R"(gravity="0 0 -9.81"/>)";

INSTANTIATE_TEST_SUITE_P(
    Extras, TwoMjcfs,
    ::testing::Values(
        Extra{"Servo", kEnd, "<actuator><position name='p' joint='elbow' kp='50'/></actuator></mujoco>",
              "<actuator><position name='p' joint='elbow' kp='51'/></actuator></mujoco>", "motor_gain"},
        Extra{"Muscle", kEnd,
              "<actuator><muscle name='p' joint='elbow' lengthrange='-1 1' timeconst='0.01 0.04'/></actuator>"
              "</mujoco>",
              "<actuator><muscle name='p' joint='elbow' lengthrange='-1 1' timeconst='0.02 0.04'/></actuator>"
              "</mujoco>",
              "motor_dynamics"},
        Extra{"Spring", R"(name="elbow")", R"(name="elbow" stiffness="2")", R"(name="elbow" stiffness="3")",
              "joint_spring"},
        Extra{"RestOfASpring", R"(name="elbow")", R"(name="elbow" stiffness="2")",
              R"(name="elbow" stiffness="2" springref="0.1")", "joint_spring"},
        Extra{"TendonSpring", kEnd,
              "<tendon><fixed name='t' stiffness='300'><joint joint='elbow' coef='1'/></fixed></tendon>"
              "</mujoco>",
              "<tendon><fixed name='t' stiffness='301'><joint joint='elbow' coef='1'/></fixed></tendon>"
              "</mujoco>",
              "tendon_spring"},
        Extra{"TendonsFriction", kEnd,
              "<tendon><fixed name='t' frictionloss='1'><joint joint='elbow' coef='1'/></fixed></tendon>"
              "</mujoco>",
              "<tendon><fixed name='t' frictionloss='2'><joint joint='elbow' coef='1'/></fixed></tendon>"
              "</mujoco>",
              "tendon_friction"},
        Extra{"Constraint", kEnd,
              "<equality><joint name='e' joint1='elbow' joint2='shoulder' polycoef='0 1 0.5 0 0'/></equality>"
              "</mujoco>",
              "<equality><joint name='e' joint1='elbow' joint2='shoulder' polycoef='0 1 0.6 0 0'/></equality>"
              "</mujoco>",
              "equality_constraint"},
        Extra{"Fluid", kGravity, R"(gravity="0 0 -9.81" density="1.2"/>)",
              R"(gravity="0 0 -9.81" density="1.3"/>)", "fluid"}),
    [](const auto& info) { return info.param.name; });

// A coefficient of a tendon's path, distinguished although its stiffness is the same.
TEST_F(TwoMjcfs, CompareTheWayOfATendon) {
  const std::string text = std::string("<tendon><fixed name='t' stiffness='300'>") +
                           "<joint joint='elbow' coef='1'/></fixed></tendon></mujoco>";
  const std::string a = ReplaceOnce(kArm, kEnd, text);
  const std::string b = ReplaceOnce(kArm, kEnd, ReplaceOnce(text, "coef='1'", "coef='-1'"));
  EXPECT_THAT(List(Compare(a, b)),
              HasSubstr("tendon_path: tendon t, point 0 of its path: 1 in a.xml, -1 in"));
}

TEST_F(TwoMjcfs, CompareWhichJointAServoMoves) {
  const std::string text = "<actuator><velocity name='p' joint='elbow' kv='50'/></actuator></mujoco>";
  const std::string a = ReplaceOnce(kArm, kEnd, text);
  const std::string b = ReplaceOnce(kArm, kEnd, ReplaceOnce(text, "elbow", "shoulder"));
  EXPECT_TRUE(Compare(a, a).result.Agrees());
  const Comparison different = Compare(a, b);
  EXPECT_EQ(List(different),
            "1. robot: motor differs: p drives elbow here, shoulder in the other file; explains 100 %\n");
}

TEST_F(TwoMjcfs, CompareTheGainsOfAServo) {
  const std::string text = "<actuator><position name='p' joint='elbow' kp='50'/></actuator></mujoco>";
  const std::string a = ReplaceOnce(kArm, kEnd, text);
  EXPECT_EQ(List(Compare(a, ReplaceOnce(a, "kp='50'", "kp='60'"))),
            "1. robot: motor differs: p (kp 50) here, (kp 60) in the other file; explains 100 %\n");
}

// Words that this engine does not know are compared as they are written.
TEST_F(TwoMjcfs, CompareNewerWordsOfServos) {
  const std::string text = "<actuator><position name='p' joint='elbow' kp='50' kv='5'/></actuator></mujoco>";
  const std::string a = ReplaceOnce(kArm, kEnd, text);
  EXPECT_TRUE(Compare(a, a).Agrees());
  EXPECT_EQ(
      List(Compare(a, ReplaceOnce(a, "kv='5'", "kv='6'"))),
      "1. robot: constraint differs: servo at joint elbow: kv 5 here, servo at joint elbow: kv 6 in the "
      "other file; explains 100 %\n");
  EXPECT_EQ(List(Compare(a, ReplaceOnce(a, " kv='5'", ""))),
            "1. robot: constraint not in the other file: servo at joint elbow: kv 5; explains 100 %\n");
  // Neither its name nor that of its joint is a part of it.
  EXPECT_TRUE(Compare(a, ReplaceOnce(a, "name='p'", "name='q'")).Agrees());
  EXPECT_TRUE(Compare(a, std::regex_replace(a, std::regex("elbow"), "Elbow")).Agrees());
}

// Bodies that both files leave to the engine differ in their shapes: none lacks an inertial.
TEST_F(TwoMjcfs, CompareBodiesThatAreComputedFromShapes) {
  EXPECT_EQ(
      List(Compare(kArm, ReplaceOnce(kArm, "size=\"0.025\"", "size=\"0.025\" density=\"500\""))),
      "1. link fore: inertial from shapes of another size, place or density, or with settotalmass: all of "
      "it 2 times the other file's; explains 100 %\n");
  EXPECT_THAT(List(Compare(kArm, ReplaceOnce(kArm, "size=\"0.025\"", "size=\"0.02\""))),
              HasSubstr("1. link fore: inertial from shapes of another size, place or density"));
}

TEST_F(TwoMjcfs, NameAJointsReference) {
  const std::string b = ReplaceOnce(kArm, "name=\"elbow\"", "name=\"elbow\" ref=\"1.5\"");
  EXPECT_THAT(List(Compare(kArm, b)),
              HasSubstr("joint elbow: rotation with another zero of the joint: ref 0 here, 1.5 in"));
}

// No term depends on the order of controls, nor on a body without mass; but what uses them does.
TEST_F(TwoMjcfs, NoteTheOrderOfMotorsAndFramesOfOtherNames) {
  const std::string with_tool = ReplaceOnce(kArm, "size=\"0.025\"/>", "size=\"0.025\"/><body name='TOOL'/>");
  const auto write = [&](const char* tool, const char* motors) {
    return ReplaceOnce(ReplaceOnce(with_tool, "TOOL", tool), kEnd,
                       std::string("<actuator>") + motors + "</actuator></mujoco>");
  };
  const std::string a = write("tool", "<motor name='m1' joint='shoulder'/><motor name='m2' joint='elbow'/>");
  const std::string b =
      write("tcp' pos='0 0 0.05", "<motor name='m2' joint='elbow'/><motor name='m1' joint='shoulder'/>");
  const Comparison other = Compare(a, b);
  EXPECT_TRUE(other.Agrees()) << List(other);
  EXPECT_THAT(
      other.without_effect,
      ::testing::Contains("order of motors, and of their controls: m1, m2 in a.xml; m2, m1 in b.xml"));
  EXPECT_THAT(other.not_compared,
              ::testing::IsSupersetOf({"frames only in a.xml: tool", "frames only in b.xml: tcp"}));
  const Comparison moved = Compare(a, ReplaceOnce(a, "name='tool'", "name='tool' pos='0 0 0.05'"));
  EXPECT_THAT(List(moved), HasSubstr("tool: position"));
}

TEST_F(TwoMjcfs, NoteSoftnessSensorsAndKeyframes) {
  const auto write = [&](const char* softness, const char* sensor, const char* qpos) {
    const std::string limit =
        std::string("name=\"elbow\" limited='true' range='-1 1' solreflimit='") + softness;
    const std::string rest = std::string("<sensor><jointpos name='encoder' joint='") + sensor +
                             "'/></sensor><keyframe><key name='home' qpos='" + qpos +
                             "'/></keyframe></mujoco>";
    return ReplaceOnce(ReplaceOnce(kArm, "name=\"elbow\"", limit + "'"), kEnd, rest);
  };
  const std::string a = write("0.02 1", "elbow", "0 0");
  EXPECT_THAT(Compare(a, a).without_effect, ::testing::IsEmpty());
  const Comparison other = Compare(a, write("0.01 1", "shoulder", "0 0.1"));
  EXPECT_TRUE(other.Agrees()) << List(other);
  EXPECT_THAT(other.without_effect,
              ::testing::ElementsAre("softness of limits: elbow", "sensors: encoder", "keyframes: home"));
}

// A slide moves along any line of its direction.
TEST_F(TwoMjcfs, MayHaveASlideAtAnyPoint) {
  const std::string a = ReplaceOnce(kArm, "name=\"elbow\"", "name=\"elbow\" type=\"slide\"");
  const std::string b = ReplaceOnce(a, "name=\"elbow\"", "name=\"elbow\" pos=\"0.03 0.02 0.01\"");
  EXPECT_TRUE(Compare(a, b).Agrees()) << List(Compare(a, b));
  // A hinge does not.
  EXPECT_FALSE(
      Compare(kArm, ReplaceOnce(kArm, "name=\"elbow\"", "name=\"elbow\" pos=\"0.03 0 0\"")).Agrees());
}

TEST_F(TwoMjcfs, MayHaveExchangedNamesOfLinks) {
  std::string b = ReplaceOnce(ReplaceOnce(kArm, "\"upper\"", "\"x\""), "\"fore\"", "\"upper\"");
  b = ReplaceOnce(b, "\"x\"", "\"fore\"");
  const Comparison exchanged = Compare(kArm, b);
  ASSERT_TRUE(exchanged.causes);
  ASSERT_EQ(exchanged.causes->items.size(), 1U) << List(exchanged);
  EXPECT_EQ(exchanged.causes->items[0].id, "exchange.link");
  EXPECT_TRUE(exchanged.causes->unexplained.empty());
}

TEST_F(TwoMjcfs, MayBothBeWithoutGravitysFlag) {
  const std::string text = R"(gravity="0 0 -9.81"><flag gravity="disable"/></option>)";
  const std::string off = ReplaceOnce(kArm, kGravity, text);
  EXPECT_TRUE(Compare(off, off).result.Agrees());
  EXPECT_THAT(List(Compare(off, kArm)), HasSubstr("switched off by <flag>: Gravity: 1 in a.xml, 0 in b.xml"));
  EXPECT_THAT(List(Compare(kArm, off)), HasSubstr("switched off by <flag>: Gravity: 0 in a.xml, 1 in b.xml"));
}

// A joint of type "free" takes some defaults of joints.
TEST_F(TwoMjcfs, CompareWhatActsOnTheJointOfTheBase) {
  const std::string damped = ReplaceOnce(kArm, R"(<body name="upper"><joint name="shoulder" axis="0 1 0"/>)",
                                         R"(<body name="upper"><joint type="free" limited="false"/>)");
  const std::string free = ReplaceOnce(damped, R"(<joint type="free" limited="false"/>)", "<freejoint/>");
  EXPECT_TRUE(Compare(damped, damped).result.Agrees());
  const std::string found = List(Compare(damped, free));
  EXPECT_THAT(found, HasSubstr("damping[0]: 0.3 N m s/rad in a.xml, 0 N m s/rad in b.xml"));
  EXPECT_THAT(found, HasSubstr("armature[5]: 0.01 kg m^2 in a.xml, 0 kg m^2 in b.xml"));
}

// How motors make their torques is no part of a URDF, and no disagreement.
TEST_F(TwoMjcfs, MotorsBesideAUrdfAreNotCompared) {
  WriteText(folder_.path() / "arm.urdf", R"(<robot name="arm">
  <link name="world"/>
  <joint name="elbow" type="revolute"><parent link="world"/><child link="fore"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <link name="fore"><inertial><origin xyz="0.1 0 0"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>)");
  WriteText(folder_.path() / "arm.xml", R"(<mujoco><compiler angle="radian"/><worldbody>
  <body name="fore"><joint name="elbow" axis="0 1 0" limited="true" range="-1 1"/>
    <inertial pos="0.1 0 0" mass="2" diaginertia="0.01 0.02 0.02"/></body></worldbody>
  <actuator><position name="servo" joint="elbow" kp="50"/><motor name="plain" joint="elbow"/></actuator>
</mujoco>)");
  ConsistencyOptions options;
  options.samples = 5;
  const Comparison comparison =
      CompareFiles(folder_.path() / "arm.urdf", folder_.path() / "arm.xml", {}, options);
  EXPECT_TRUE(comparison.result.Agrees()) << List(comparison);
  EXPECT_THAT(comparison.not_compared,
              ::testing::Contains("motors: only arm.xml says how they make their forces (servos, muscles, "
                                  "transmissions, gears): servo"));
}

}  // namespace
}  // namespace dexcheck::testing::engine_parts_test
