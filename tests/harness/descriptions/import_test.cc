// A description is written as a parameter file that reads back to the same model; an engine's model is
// described as the engine has it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "controller/common/errors.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "harness/comparison/consistency.h"
#include "harness/comparison/description_match.h"
#include "harness/comparison/engine_constants.h"
#include "harness/comparison/file_differences.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/read_description.h"
#include "harness/descriptions/urdf_reader.h"
#include "harness/engine/engine.h"
#include "tests/common/files.h"
#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"
#include "tests/common/throws.h"
#include "tests/common/urdf_text.h"

namespace dexcheck::testing::import_test {
namespace {

// Numbers are written to 8 eps of their vector's size; chains of at most 13 joints and a few kg.
constexpr double kRounding = 1e-12;

Matrix3d MakeRotation(const Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

TEST(RollPitchYaw, GivesEveryRotationBack) {
  constexpr double kEps = 1e-14;
  for (int roll = -4; roll <= 4; ++roll) {
    for (int pitch = -4; pitch <= 4; ++pitch) {
      for (int yaw = -4; yaw <= 4; ++yaw) {
        for (const double off : {0.0, 1e-16, 1e-12, 1e-9, 1e-6, 0.1}) {
          const Vector3d angles(roll * kPi / 4.0 + off, pitch * kPi / 4.0 - off, yaw * kPi / 4.0 + 2.0 * off);
          const Matrix3d R = MakeRotation(angles);
          EXPECT_TRUE(MatrixNear(MakeRotation(CalcRollPitchYaw(R)), R, kEps)) << angles.transpose();
        }
      }
    }
  }
}

void ExpectSameModel(const RobotModel& a, const RobotModel& b, std::mt19937* random) {
  ASSERT_EQ(a.num_joints(), b.num_joints());
  ASSERT_EQ(a.frames().size(), b.frames().size());
  for (int i = 0; i < a.num_joints(); ++i) {
    const Joint& x = a.joint(i);
    const Joint& y = b.joint(i);
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.link, y.link);
    EXPECT_EQ(x.parent, y.parent);
    EXPECT_EQ(x.lower, y.lower);
    EXPECT_EQ(x.upper, y.upper);
    EXPECT_EQ(x.damping, y.damping);
    EXPECT_EQ(x.armature, y.armature);
  }
  ModelTerms terms_a(a);
  ModelTerms terms_b(b);
  for (int sample = 0; sample < 3; ++sample) {
    const VectorXd q = DrawPositions(a, random);
    const VectorXd xi = DrawVelocities(a.num_velocities(), random);
    for (ModelTerms* terms : {&terms_a, &terms_b}) {
      terms->SetState(q, xi);
      terms->CalcDynamics();
    }
    EXPECT_TRUE(MatrixNear(terms_a.M(), terms_b.M(), kRounding));
    EXPECT_TRUE(MatrixNear(terms_a.C(), terms_b.C(), 10.0 * kRounding));
    EXPECT_TRUE(MatrixNear(terms_a.gravity(), terms_b.gravity(), 10.0 * kRounding));
    EXPECT_TRUE(MatrixNear(terms_a.friction(), terms_b.friction(), kRounding));
    for (int frame = 0; frame < static_cast<int>(a.frames().size()); ++frame) {
      EXPECT_TRUE(MatrixNear(terms_a.CalcFramePose(frame).matrix(), terms_b.CalcFramePose(frame).matrix(),
                             kRounding));
    }
  }
}

TEST(Import, OfAUrdfReadsBackToTheSameModel) {
  std::mt19937 random(1702);
  for (int index = 0; index < 20; ++index) {
    RandomRobotOptions options;
    options.base = BaseType::kFixed;
    options.joints = 1 + index % 13;
    RobotSpec spec = MakeRandomRobot(options, &random);
    const RobotDescription robot = ParseUrdf(WriteUrdf(&spec, &random), "robot.urdf");
    const std::string text = WriteParameters(robot, "robot.urdf");
    SCOPED_TRACE(text);
    ExpectSameModel(RobotModel(robot.spec), ParseRobotModel(text, "robot.toml"), &random);
  }
}

TEST(Import, OfTheShippedPandaReadsBackToTheSameModel) {
  std::mt19937 random(1703);
  const MjModelPtr engine = LoadMjcf(SourcePath("/mjcf/panda.xml"));
  const RobotDescription robot = ReadMjcfDescription(*engine, "panda.xml");
  const std::string text = WriteParameters(robot, "panda.xml");
  const RobotModel imported = ParseRobotModel(text, "imported.toml");
  ExpectSameModel(RobotModel(robot.spec), imported, &random);
  ExpectSameModel(ReadRobotModel(SourcePath("/controller/parameters/panda.toml")), imported, &random);
  // The text is one that a person would write.
  EXPECT_THAT(text, HasSubstr(R"({ joint = "panda_joint1", link = "panda_link1", xyz = [0, 0, 0.333] },)"));
  EXPECT_THAT(text, HasSubstr(R"(rpy = ["-pi / 2", 0, 0])"));
  EXPECT_THAT(text, HasSubstr("mass = 3.228604\ncom = [0.027518, 0.039252, -0.066502]\n"));
}

// Anchors beside the bodies' origins, odd axes, a position that is not zero at rest, two joints on one body,
// welded bodies, a coupled joint.
constexpr const char* kSuspicious = R"(<mujoco model="odd">
<compiler angle="radian"/>
<option gravity="0.5 0 -9"/>
<worldbody><body name="stand" pos="0.1 0.2 0.3" euler="0.1 0.2 0.3">
  <body name="arm" pos="0 0.1 0.2" quat="0.8 0 0.6 0">
    <joint name="shoulder" pos="0.1 -0.2 0.05" axis="1 2 -2" ref="0.3" damping="0.2" armature="0.1"/>
    <inertial pos="0.1 0 0.2" quat="0.6 0.8 0 0" mass="2" diaginertia="0.02 0.03 0.04"/>
    <body name="cover" pos="0.2 0 0"><inertial pos="0 0 0.1" mass="0.5" diaginertia="0.001 0.001 0.001"/></body>
    <body name="hand" pos="0.3 0 0">
      <joint name="reach" type="slide" axis="0 1 0" ref="-0.1" limited="true" range="-0.3 0.4" frictionloss="0.7"/>
      <inertial pos="0 0.1 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <site name="tool" pos="0 0 0.1" euler="0 1 0"/>
    </body>
  </body>
</body></worldbody>
<equality><joint joint1="reach" joint2="shoulder" polycoef="0.01 0.5 0 0 0"/></equality>
<actuator><motor joint="reach"/></actuator>
</mujoco>)";

TEST(MjcfDescription, IsTheEnginesModel) {
  const MjModelPtr engine = LoadMjcfText(kSuspicious, "odd.xml");
  const RobotDescription robot = ReadMjcfDescription(*engine, "odd.xml");
  const RobotModel model(robot.spec);
  EXPECT_EQ(model.base().link, "stand");
  ConsistencyOptions options;
  options.samples = 50;
  const Adapter adapter(model, *engine, "odd.xml");
  const ConsistencyResult result = CheckConsistency(adapter, options, [](long) { return true; });
  for (const CheckRecord& record : result.terms) EXPECT_FALSE(record.failed) << record.name;
  // Tables have no place for some parts of the description.
  std::vector<std::string> found;
  for (const ConstantFinding& finding : result.constants.findings) found.push_back(finding.check);
  EXPECT_THAT(found, ElementsAre("equality_constraint"));
  const ConstantChecks constants = CheckConstants(adapter, ListEngineParts(adapter, {false, true}), {true});
  EXPECT_THAT(constants.not_compared, IsEmpty());
  EXPECT_TRUE(constants.findings.empty());
  for (const CheckRecord& record : constants.records) EXPECT_FALSE(record.failed) << record.name;
  EXPECT_EQ(robot.spec.joints[1].dry_friction, 0.7);
  EXPECT_FALSE(robot.joints[0].states_range);
  EXPECT_TRUE(robot.joints[1].states_range);
  ASSERT_TRUE(robot.spec.joints[1].coupling);
  EXPECT_EQ(robot.spec.joints[1].coupling->leader, 0);
  EXPECT_EQ(robot.spec.joints[1].coupling->multiplier, 0.5);
  // reach + 0.1 = 0.01 + 0.5 (shoulder - 0.3)
  EXPECT_DOUBLE_EQ(robot.spec.joints[1].coupling->offset, 0.01 - 0.1 - 0.15);
  EXPECT_THAT(robot.notes, ElementsAre("not taken over: 1 actuators"));

  std::mt19937 random(1704);
  ExpectSameModel(model, ParseRobotModel(WriteParameters(robot, "odd.xml"), "odd.toml"), &random);
}

TEST(MjcfDescription, RefusesWhatDoesNotMove) {
  const MjModelPtr engine =
      LoadMjcfText(R"(<mujoco><worldbody><geom size="1"/></worldbody></mujoco>)", "text");
  EXPECT_TRUE(Throws<InputError>([&] { ReadMjcfDescription(*engine, "scene.xml"); },
                                 {"scene.xml: must have a joint: nothing in it moves"}));
}

TEST(MjcfDescription, OneBodyThatFloatsIsARobot) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path() / "ball.xml";
  WriteText(
      file,
      R"(<mujoco><worldbody><body name="ball"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>)");
  const std::filesystem::path table = folder.path() / "ball.toml";
  WriteText(table, WriteParameters(ReadDescription(file), "ball.xml"));
  ConsistencyOptions options;
  options.samples = 10;
  EXPECT_TRUE(CompareFiles(table, file, {}, options).result.Agrees());
}

// The names are `dexcheck`'s: "#" and the number in the engine's model.
TEST(MjcfDescription, JointsAndBodiesWithoutNamesAreCounted) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path() / "arm.xml";
  WriteText(file,
            R"(<mujoco><worldbody><body><joint axis="0 1 0"/><geom size="0.1" pos="0.1 0 0"/><body )"
            R"(pos="0.2 0 0"><joint axis="0 1 0"/><geom size="0.1" pos="0.1 0 0"/></body></body></worldbody>)"
            "</mujoco>");
  const RobotDescription robot = ReadDescription(file);
  EXPECT_EQ(robot.spec.joints[1].name, "#1");
  EXPECT_EQ(robot.spec.joints[1].link, "#2");
  ConsistencyOptions options;
  options.samples = 10;
  const Comparison same = CompareFiles(file, file, {}, options);
  EXPECT_TRUE(same.result.Agrees()) << ::testing::PrintToString(ListDifferences(same));
  const std::filesystem::path table = folder.path() / "arm.toml";
  WriteText(table, WriteParameters(robot, "arm.xml"));
  EXPECT_TRUE(CompareFiles(table, file, {}, options).result.Agrees());
}

// A URDF's numbers cost no more than a table's: both become the same analytic model.
TEST(ImportedRobot, IsOfTheTablesSize) {
  std::mt19937 random(50);
  RandomRobotOptions robot;
  robot.base = BaseType::kFixed;
  robot.joints = 50;
  RobotSpec spec = MakeRandomRobot(robot, &random);
  const std::string urdf = WriteUrdf(&spec, &random);
  RobotDescription description = ParseUrdf(urdf, "robot.urdf");
  CompleteFromEngine(*LoadMjcfText(WriteMjcf(spec), "robot.xml"), "robot.xml", &description);
  const RobotModel of_table = ParseRobotModel(WriteParameters(description, "robot.urdf"), "robot.toml");
  const RobotModel of_urdf(description.spec);
  EXPECT_EQ(of_urdf.num_joints(), of_table.num_joints());
  EXPECT_EQ(of_urdf.num_velocities(), of_table.num_velocities());
  EXPECT_EQ(of_urdf.frames().size(), of_table.frames().size());
}

}  // namespace
}  // namespace dexcheck::testing::import_test
