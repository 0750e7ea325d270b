// Robots with a floating base: tables, URDFs, MJCFs and the engine agree to rounding, and what differs is
// found.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "controller/common/errors.h"
#include "controller/model/parameter_reader.h"
#include "harness/comparison/consistency.h"
#include "harness/comparison/description_match.h"
#include "harness/comparison/file_differences.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/urdf_reader.h"
#include "harness/engine/engine.h"
#include "tests/common/files.h"
#include "tests/common/legged_robots.h"
#include "tests/common/list_failures.h"
#include "tests/common/matchers.h"
#include "tests/common/random_robot.h"
#include "tests/common/throws.h"
#include "tests/common/urdf_text.h"

namespace dexcheck::testing::floating_base_test {
namespace {

ConsistencyOptions Few(long samples = 20) {
  ConsistencyOptions options;
  options.samples = samples;
  return options;
}

std::string CompleteAndCompare(RobotDescription robot, const mjModel& engine) {
  CompleteFromEngine(engine, "robot.xml", &robot);
  return CompareWithEngine(robot, engine);
}

std::string CompareBoth(RobotDescription a, RobotDescription b) {
  CompleteEachOther(&a, &b);
  return ListFailures(CompareDescriptions(a, b, Few()));
}

TEST(FloatingBase, RandomRobotsAgree) {
  std::mt19937 random(1720);
  for (int index = 0; index < 20; ++index) {
    RandomRobotOptions options;
    options.base = BaseType::kFloating;
    options.joints = 1 + index % 13;
    options.branching = 0.1 * (index % 6);
    RobotSpec spec = MakeRandomRobot(options, &random);
    RobotDescription urdf = ParseUrdf(WriteUrdf(&spec, &random), "robot.urdf");
    urdf.spec.gravity = spec.gravity;
    urdf.states_gravity = true;
    const MjModelPtr engine = LoadMjcfText(WriteMjcf(spec), "text");
    EXPECT_EQ(CompleteAndCompare(urdf, *engine), "") << "robot " << index;
    const RobotDescription mjcf = ReadMjcfDescription(*engine, "robot.xml");
    // A URDF has no word for armature.
    const bool has_armature = std::ranges::any_of(mjcf.spec.joints, &Joint::armature);
    EXPECT_EQ(CompareBoth(urdf, mjcf), has_armature ? "joint_armature " : "") << "robot " << index;
    // Angles of a table are rounded twice: when they are written, and when they are read.
    constexpr double kWritten = 1e-13;
    const RobotModel table = ParseRobotModel(WriteParameters(mjcf, "robot.xml"), "robot.toml");
    const ConsistencyResult result =
        CheckConsistency(Adapter(table, *engine, "robot.xml"), Few(), [](long) { return true; });
    for (const CheckRecord& record : result.terms) EXPECT_LT(record.worst, kWritten) << record.name;
  }
}

/// A robot written twice, by hand and by other conventions.
class LeggedRobots : public ::testing::TestWithParam<std::string> {
 protected:
  LeggedRobots()
      : links_(GetParam() == "quadruped" ? ListQuadruped() : ListHumanoid()),
        urdf_(WriteLeggedUrdf(GetParam(), links_)),
        engine_(LoadMjcfText(WriteLeggedMjcf(GetParam(), links_), "robot.xml")) {}

  std::vector<LeggedLink> links_;
  std::string urdf_;
  MjModelPtr engine_;
};

TEST_P(LeggedRobots, UrdfMjcfAndTableAgree) {
  const RobotDescription urdf = ParseUrdf(urdf_, "robot.urdf");
  EXPECT_FALSE(urdf.states_base);
  EXPECT_EQ(urdf.spec.joints.size(), GetParam() == "quadruped" ? 12U : 31U);
  EXPECT_EQ(CompleteAndCompare(urdf, *engine_), "");
  EXPECT_EQ(CompareBoth(urdf, ReadMjcfDescription(*engine_, "robot.xml")), "");
  UrdfOptions floating;
  floating.floating = true;
  RobotDescription floats = ParseUrdf(urdf_, "robot.urdf", floating);
  floats.spec.gravity = Vector3d(0.0, 0.0, -9.81);
  EXPECT_TRUE(floats.states_base);
  EXPECT_EQ(CompareBoth(ReadTable(WriteParameters(floats, "robot.urdf")), floats), "");
}

TEST_P(LeggedRobots, FaultsOfTheBaseAreFound) {
  const std::string base = links_[0].name;
  const auto expect = [&](const std::string& original, const std::string& changed,
                          const std::string& found_by) {
    const std::string text = ReplaceFirst(urdf_, original, changed);
    const std::string failures = CompleteAndCompare(ParseUrdf(text, "robot.urdf"), *engine_);
    EXPECT_THAT(failures, HasSubstr(found_by));
    EXPECT_THAT(failures, HasSubstr("M_bar"));
  };
  const LeggedLink& link = links_[0];
  expect("xyz=\"" + link.com + "\"", R"(xyz="0.02 0 0")", "link_com");
  expect("rpy=\"" + link.com_rpy + "\"", R"(rpy="0 0 0")", "link_inertia");
  expect(fmt::format(R"(<mass value="{}"/>)", link.mass), R"(<mass value="5"/>)", "link_mass");
}

// Publishers declare a floating base by an empty footprint, a joint of the type "floating", or the name
// "world".
TEST_P(LeggedRobots, RootsThatPublishersWrite) {
  const std::string base = links_[0].name;
  const auto with_root = [&](const std::string& root) {
    std::string text = urdf_;
    return text.insert(text.find('\n') + 1, root);
  };
  const RobotDescription footprint =
      ParseUrdf(with_root(R"(<link name="footprint"/><joint name="up" type="fixed"><origin xyz="0.1 0 )"
                          R"(0.3" rpy="0 0.2 0"/>)"
                          R"(<parent link="footprint"/><child link=")" +
                          base + "\"/></joint>"),
                "robot.urdf");
  EXPECT_EQ(footprint.spec.base.link, "footprint");
  EXPECT_EQ(CompleteAndCompare(footprint, *engine_), "");
  EXPECT_EQ(CompareBoth(footprint, ReadMjcfDescription(*engine_, "robot.xml")), "");
  const RobotDescription floating =
      ParseUrdf(with_root(R"(<link name="world"/><joint name="free" type="floating"><parent )"
                          R"(link="world"/><child link=")" +
                          base + "\"/></joint>"),
                "robot.urdf");
  EXPECT_EQ(floating.spec.base.link, base);
  EXPECT_EQ(floating.spec.base.type, BaseType::kFloating);
  EXPECT_EQ(CompleteAndCompare(floating, *engine_), "");

  const RobotDescription fixed = ParseUrdf(
      with_root(R"(<link name="world"/><joint name="weld" type="fixed"><parent link="world"/><child link=")" +
                base + "\"/></joint>"),
      "robot.urdf");
  EXPECT_TRUE(fixed.states_base);
  EXPECT_THROW(CompleteAndCompare(fixed, *engine_), InputError);
  EXPECT_THROW(CompareBoth(fixed, ReadMjcfDescription(*engine_, "robot.xml")), InputError);
}

TEST_P(LeggedRobots, FixedInOneFileAndFloatingInTheOtherIsSaid) {
  const MjModelPtr fixed = LoadMjcfText(WriteLeggedMjcf(GetParam(), links_, ""), "fixed.xml");
  UrdfOptions floating;
  floating.floating = true;
  EXPECT_THROW(CompleteAndCompare(ParseUrdf(urdf_, "robot.urdf", floating), *fixed), InputError);
  RobotDescription urdf = ParseUrdf(urdf_, "robot.urdf");
  RobotDescription mjcf = ReadMjcfDescription(*engine_, "robot.xml");
  const std::vector<std::string> notes = CompleteEachOther(&urdf, &mjcf).notes;
  EXPECT_THAT(notes,
              Contains(HasSubstr(
                  "base: robot.urdf does not say how its root moves; it floats as that of robot.xml")));
  EXPECT_THAT(DescribeCoordinates(urdf),
              Contains(HasSubstr("q = [x y z, qw qx qy qz, joints from q[7]], xi = [velocity of its origin "
                                 "in world axes, angular velocity in its own axes, joints from xi[6]]")));
}

INSTANTIATE_TEST_SUITE_P(FloatingBase, LeggedRobots, ::testing::Values("quadruped", "humanoid"));

// A scene has objects beside the robot, and published files have parts parked in the world.
TEST(FloatingBase, TheRobotIsTheTreeWithTheMostJoints) {
  const auto make = [](const std::string& more) {
    return R"(<mujoco><worldbody><body name="trunk"><freejoint/><geom size="1"/><body name="leg"><joint )"
           R"(name="j"/><geom size="1"/><body name="foot"><joint name="k"/><geom )"
           R"(size="1"/></body></body></body>)" +
           more + "</worldbody></mujoco>";
  };
  const TempFolder folder;
  const std::filesystem::path alone = folder.path() / "alone.xml";
  const std::filesystem::path scene = folder.path() / "scene.xml";
  WriteText(alone, make(""));
  WriteText(scene, make(R"(<body name="ball"><freejoint name="b"/><geom size="1"/></body><body name="spare">)"
                        R"(<joint name="s"/><geom size="1"/></body>)"));
  const RobotDescription robot = ReadDescription(scene);
  EXPECT_EQ(robot.spec.base.link, "trunk");
  EXPECT_EQ(robot.spec.joints.size(), 2U);
  EXPECT_EQ(robot.notes,
            std::vector<std::string>{"no part of the robot, which has the most joints: ball, spare"});
  ConsistencyOptions options;
  options.samples = 10;
  for (const auto& [a, b] : {std::pair(alone, scene), std::pair(scene, alone), std::pair(scene, scene)}) {
    const Comparison comparison = CompareFiles(a, b, {}, options);
    EXPECT_TRUE(comparison.result.Agrees()) << ::testing::PrintToString(ListDifferences(comparison));
    const bool is_said =
        std::ranges::find(comparison.not_compared, "not connected to the robot: joints b, s") !=
        comparison.not_compared.end();
    EXPECT_EQ(is_said, b == scene);
  }
}

TEST(FloatingBase, TwoRobotsAreRefused) {
  const MjModelPtr two = LoadMjcfText(
      R"(<mujoco><worldbody><body name="a"><freejoint/><geom size="1"/></body><body name="b"><freejoint/>)"
      R"(<geom size="1"/></body></worldbody></mujoco>)",
      "two.xml");
  EXPECT_TRUE(Throws<InputError>([&] { ReadMjcfDescription(*two, "two.xml"); },
                                 {R"(two.xml: must have one robot; "a" and "b" carry as many joints)"}));
}

// The engine's coordinates are the world's, and round by the world's size.
TEST(FloatingBase, SmallRobotsAgreeToRounding) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path() / "bug.xml";
  WriteText(
      file,
      R"(<mujoco><worldbody><body name="bug"><freejoint/><geom size="0.02 0.01 0.005" type="box" pos="0.01 0 0"/>
    <body name="leg" pos="0.01 0 0"><joint name="hip" axis="0 1 0"/><geom size="0.004" pos="0.01 0 0"/></body></body>
    </worldbody></mujoco>)");
  const Comparison comparison = CompareFiles(file, file, {}, {});
  EXPECT_TRUE(comparison.result.Agrees()) << ::testing::PrintToString(ListDifferences(comparison));
}

}  // namespace
}  // namespace dexcheck::testing::floating_base_test
