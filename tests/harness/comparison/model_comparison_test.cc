// Two descriptions without the engine: they agree when they describe one robot, whatever the order of joints
// and the choice of frames, and what differs is found.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "harness/comparison/consistency.h"
#include "harness/comparison/description_match.h"
#include "harness/descriptions/alike_names.h"
#include "harness/descriptions/read_description.h"
#include "tests/common/list_failures.h"
#include "tests/common/matchers.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"
#include "tests/common/throws.h"
#include "tests/common/urdf_text.h"
#include "tests/harness/descriptions/panda_urdf.h"
#include "tests/harness/descriptions/robot_pairs.h"

namespace dexcheck::testing::model_comparison_test {
namespace {

std::string ListFailures(RobotDescription a, RobotDescription b, long samples = 20) {
  CompleteEachOther(&a, &b);
  ConsistencyOptions options;
  options.samples = samples;
  return testing::ListFailures(CompareDescriptions(a, b, options));
}

RobotDescription ReadPandaTable() { return ReadDescription(SourcePath("/controller/parameters/panda.toml")); }

TEST(ModelComparison, PandaByTableByUrdfAndByMjcf) {
  const RobotDescription urdf = ParseUrdf(MakePandaUrdf(), "panda.urdf");
  const RobotDescription mjcf = ReadDescription(SourcePath("/mjcf/panda.xml"));
  EXPECT_EQ(ListFailures(ReadPandaTable(), urdf, 200), "");
  EXPECT_EQ(ListFailures(urdf, ReadPandaTable()), "");
  EXPECT_EQ(ListFailures(mjcf, urdf), "");
}

TEST(ModelComparison, RandomUrdfsWithOtherFramesAgree) {
  std::mt19937 random(1710);
  for (int index = 0; index < 20; ++index) {
    RandomRobotOptions options;
    options.base = BaseType::kFixed;
    options.joints = 1 + index % 13;
    RobotSpec spec = MakeRandomRobot(options, &random);
    // The welded bodies are part of the specification after this.
    const RobotDescription turned = ParseUrdf(WriteUrdf(&spec, &random, 0.3), "turned.urdf");
    const RobotDescription straight = ParseUrdf(WriteUrdf(&spec, nullptr, 0.3), "straight.urdf");
    EXPECT_EQ(ListFailures(turned, straight), "") << "robot " << index;
  }
}

// A published humanoid's head has the inertia ixz = 2.4e-35 kg m^2 alone, in a frame that another file turns.
TEST(ModelComparison, WhatRoundingLeftOfAPointsInertiaIsNone) {
  const auto parse = [](const std::string& inertia) {
    return ParseUrdf(
        R"(<robot name="point"><link name="base"/><link name="head"><inertial><mass value="1.3"/>)" +
            std::string(R"(<origin xyz="0.0185 -0.1108 0"/>)") + inertia +
            R"(</inertial></link><joint name="neck" type="revolute"><parent link="base"/>)"
            R"(<child link="head"/><axis xyz="0 0 1"/>)"
            R"(<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>)",
        "point.urdf");
  };
  const RobotDescription point = parse(R"(<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="2.4e-35" iyz="0"/>)");
  const RobotDescription other = parse(R"(<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="1e-35"/>)");
  EXPECT_EQ(ListFailures(point, other), "");
  const RobotDescription small =
      parse(R"(<inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" ixz="0" iyz="0"/>)");
  EXPECT_THAT(ListFailures(point, small), HasSubstr("link_inertia"));
}

// A quadrotor whose propellers are fixed.
TEST(ModelComparison, OneBodyThatFloatsIsARobot) {
  const auto parse = [](const std::string& mass) {
    UrdfOptions options;
    options.floating = true;
    return ParseUrdf(
        R"(<robot name="drone"><link name="body"><inertial><mass value=")" + mass +
            R"("/><origin xyz="0.01 0 0"/><inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0"
                         iyz="0"/></inertial></link></robot>)",
        "drone.urdf", options);
  };
  EXPECT_EQ(ListFailures(parse("1.5"), parse("1.5")), "");
  EXPECT_THAT(ListFailures(parse("1.5"), parse("1.6")), HasSubstr("M"));
}

/// Two arms on one base; the order of joints is the file's.
std::string MakeTwoArms(bool left_first) {
  const auto arm = [](const std::string& name, const std::string& y) {
    return "<link name=\"" + name +
           R"("><inertial><origin xyz="0.1 0 0.2"/><mass value="2"/><inertia ixx="0.1" )" +
           R"(ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link><joint name=")" + name +
           R"(_joint" type="continuous"><origin xyz="0 )" + y + R"( 0"/><parent link="base"/><child link=")" +
           name + "\"/><axis xyz=\"0 1 0\"/></joint>\n";
  };
  const std::string left = arm("left", "1");
  const std::string right = arm("right", "-1");
  return "<robot name=\"two\"><link name=\"base\"/>\n" + (left_first ? left + right : right + left) +
         "</robot>";
}

TEST(ModelComparison, DoesNotMindTheOrderOfJoints) {
  const RobotDescription a = ParseUrdf(MakeTwoArms(true), "a.urdf");
  const RobotDescription b = ParseUrdf(MakeTwoArms(false), "b.urdf");
  EXPECT_EQ(a.spec.joints[0].name, "left_joint");
  EXPECT_EQ(b.spec.joints[0].name, "right_joint");
  EXPECT_EQ(ListFailures(a, b), "");
}

TEST(ModelComparison, FindsWhatDiffers) {
  const RobotDescription right = ParseUrdf(MakePandaUrdf(), "panda.urdf");
  RobotDescription wrong = right;
  wrong.spec.joints[3].body.com.y() += 1e-6;
  EXPECT_THAT(ListFailures(right, wrong), HasSubstr("link_com"));
  EXPECT_THAT(ListFailures(right, wrong), HasSubstr("gravity"));
  wrong = right;
  wrong.spec.joints[6].body.mass *= 1.0001;
  EXPECT_THAT(ListFailures(right, wrong), HasSubstr("link_mass"));
  EXPECT_THAT(ListFailures(right, wrong), HasSubstr("M_bar"));
  EXPECT_THAT(ListFailures(right, wrong), HasSubstr("C_bar"));
  wrong = right;
  wrong.spec.joints[2].dry_friction = 0.1;
  EXPECT_EQ(ListFailures(right, wrong), "joint_dry_friction ");
  wrong = right;
  wrong.spec.joints[2].damping = 0.1;
  EXPECT_EQ(ListFailures(right, wrong), "joint_damping friction ");
  wrong = right;
  wrong.spec.frames[0].X_LF.translation().x() += 1e-9;
  EXPECT_THAT(ListFailures(right, wrong), HasSubstr("frame_pose"));
}

TEST(ModelComparison, WhatOneLacksIsNotCompared) {
  RobotDescription urdf = ParseUrdf(MakePandaUrdf(), "panda.urdf");
  RobotDescription table = ReadPandaTable();
  table.spec.joints[1].armature = 0.1;
  table.spec.gravity.x() = 1.0;
  urdf.spec.joints[2].link = "elbow";
  EXPECT_EQ(ListFailures(urdf, table), "joint_armature ");
  const Completion completion = CompleteEachOther(&urdf, &table);
  EXPECT_THAT(completion.not_compared, ::testing::Contains(HasSubstr("gravity: only")));
  EXPECT_THAT(completion.notes, ::testing::Contains(R"(links by other names: "panda_link3" is "elbow")"));
  EXPECT_EQ(urdf.spec.joints[1].armature, 0.1);
}

TEST(ModelComparison, RefusesOtherMechanisms) {
  const RobotDescription right = ParseUrdf(MakePandaUrdf(), "panda.urdf");
  const auto problem = [&](RobotDescription other) {
    RobotDescription own = right;
    return MessageOf<InputError>([&] { CompleteEachOther(&own, &other); });
  };
  RobotDescription other = right;
  other.spec.source = "other.urdf";
  other.spec.joints[2].name = "elbow";
  other.spec.joints[3].type = JointType::kPrismatic;
  EXPECT_EQ(problem(other),
            R"(other.urdf: does not match panda.urdf; only in panda.urdf: joint "panda_joint3"; only in )"
            "other.urdf: "
            R"(joint "elbow")");
  other = right;
  other.spec.source = "other.urdf";
  other.spec.joints[2].type = JointType::kPrismatic;
  EXPECT_EQ(problem(other), R"(other.urdf: joint "panda_joint3": must be revolute as in panda.urdf)");
  other = right;
  other.spec.source = "other.urdf";
  other.spec.joints[2].parent = 0;
  EXPECT_EQ(
      problem(other),
      R"(other.urdf: joint "panda_joint3": must come after "panda_joint2" as in panda.urdf, comes after )"
      R"("panda_joint1")");
}

// Every joint and link renamed, and the humanoid's limbs in another order: by its place each is the one it
// was.
TEST(StructureMatch, FindsTheJointsOfOtherNames) {
  for (const RobotPair& pair : ListRobotPairs()) {
    SCOPED_TRACE(pair.name);
    RobotDescription other = pair.b;
    for (size_t i = 0; i < other.spec.joints.size(); ++i) {
      other.spec.joints[i].name = "x" + std::to_string(7 * i % 101);
      other.spec.joints[i].link = "y" + std::to_string(i);
    }
    EXPECT_EQ(MatchByStructure(pair.a, other), MatchJoints(pair.a.spec, pair.b.spec));
    RobotDescription own = pair.a;
    EXPECT_THAT(CompleteEachOther(&own, &other).notes, ::testing::Contains(HasSubstr("matched by the tree")));
  }
}

TEST(StructureMatch, KeepsNamesThatBothHave) {
  const RobotDescription right = ParseUrdf(MakePandaUrdf(), "panda.urdf");
  RobotDescription other = right;
  other.spec.joints[2].name = "elbow";
  EXPECT_EQ(MatchByStructure(right, other), std::vector<int>({0, 1, 2, 3, 4, 5, 6}));
  // A joint of that name is elsewhere.
  other.spec.joints[4].name = "panda_joint3";
  EXPECT_TRUE(MatchByStructure(right, other).empty());
  other = right;
  other.spec.joints[2].type = JointType::kPrismatic;
  EXPECT_TRUE(MatchByStructure(right, other).empty());
}

TEST(AlikeNames, HaveOnePartnerEach) {
  using Names = std::vector<std::string>;
  const Names numbered = {"joint1", "joint2", "joint3"};
  EXPECT_EQ(FindAlikeNames(numbered, {"joint3", "joint1", "joint2"}), numbered);
  EXPECT_EQ(FindAlikeNames(numbered, {"panda_joint3", "panda_joint2", "panda_joint1"}),
            Names({"panda_joint1", "panda_joint2", "panda_joint3"}));
  EXPECT_EQ(FindAlikeNames({"LeftKnee", "RightKnee"}, {"right_knee", "left_knee"}),
            Names({"left_knee", "right_knee"}));
  EXPECT_EQ(FindAlikeNames({"hip_joint", "knee_joint"}, {"knee", "hip"}), Names({"hip", "knee"}));
  EXPECT_EQ(FindAlikeNames(numbered, {"joint1", "joint2", "joint4"}), Names());
  EXPECT_EQ(FindAlikeNames(numbered, {"joint1", "joint2"}), Names());
  EXPECT_EQ(FindAlikeNames({"a.b", "ab"}, {"ab", "A_B"}), Names());  // which is which?
  EXPECT_EQ(FindAlikeNames({}, {}), Names());
}

TEST(AlikeNames, AreTakenAndNoted) {
  const RobotDescription urdf = ParseUrdf(MakePandaUrdf(), "panda.urdf");
  RobotDescription other = ReadDescription(SourcePath("/mjcf/panda.xml"));
  for (size_t i = 0; i < other.spec.joints.size(); ++i)
    other.spec.joints[i].name = "Joint " + std::to_string(i + 1);
  EXPECT_EQ(ListFailures(urdf, other), "");
  RobotDescription own = urdf;
  EXPECT_THAT(CompleteEachOther(&own, &other).notes,
              ::testing::Contains(HasSubstr(R"(joints by other names: "Joint 1" is )"
                                            R"("panda_joint1")")));
}

}  // namespace
}  // namespace dexcheck::testing::model_comparison_test
