#include "controller/model/parameter_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::parameter_reader_test {
namespace {

const std::filesystem::path kParameters = SourcePath("/controller/parameters");

// A chain of at most 13 transforms of size 1, some four roundings each, and pi/2 rounded once per joint.
constexpr double kRounding = 100.0 * std::numeric_limits<double>::epsilon();

/// Pose of each link in the world frame at q = 0.
std::vector<Pose> CalcHomePoses(const RobotModel& model) {
  std::vector<Pose> X_WL;
  for (const Joint& joint : model.joints()) {
    const Pose X_WP = joint.parent < 0 ? model.base().X_B0 : X_WL[static_cast<size_t>(joint.parent)];
    const MdhRow& row = joint.mdh;
    X_WL.push_back(X_WP * joint.X_PB * CalcMdhTransform(row.alpha, row.a, row.q, row.d));
  }
  return X_WL;
}

Pose CalcHomePose(const RobotModel& model, const std::string& frame_name) {
  const Frame& frame = model.frame(model.FindFrame(frame_name));
  return CalcHomePoses(model)[static_cast<size_t>(frame.link)] * frame.X_LF;
}

/// A body's joint and centre of mass in the world frame.
struct Landmark {
  std::string joint;
  Vector3d axis;
  Vector3d origin;
  Vector3d com;
};

class AssistantRobot : public ::testing::Test {
 protected:
  const RobotModel model_ = ReadRobotModel(kParameters / "assistant_robot.toml");
};

TEST_F(AssistantRobot, HasThePapersCoordinates) {
  EXPECT_EQ(model_.num_joints(), 48);
  EXPECT_EQ(model_.num_positions(), 51);
  EXPECT_EQ(model_.num_velocities(), 50);
  EXPECT_EQ(model_.max_depth(), 13);  // waist 2, arm 7, finger 4
  EXPECT_EQ(model_.base().type, BaseType::kDifferentialDrive);
  EXPECT_EQ(model_.gravity(), Vector3d(0.0, 0.0, -9.81));

  std::vector<std::string> expected = {"waist_yaw", "waist_pitch"};
  for (const std::string side : {"r_", "l_"}) {
    for (const char* joint : {"shoulder_pitch", "shoulder_roll", "upper_arm_yaw", "elbow", "wrist_deviation",
                              "wrist_flexion", "palm_roll"}) {
      expected.push_back(side + joint);
    }
  }
  for (const std::string side : {"r", "l"}) {
    for (const char* finger : {"f1_", "f2_", "f3_", "f4_"}) {
      for (const char* joint : {"1", "2", "3", "4"}) expected.push_back(side + finger + joint);
    }
  }
  std::vector<std::string> names;
  for (const Joint& joint : model_.joints()) names.push_back(joint.name);
  EXPECT_EQ(names, expected);
  std::vector<std::string> tips;
  for (const int tip : model_.fingertips()) tips.push_back(model_.frame(tip).name);
  EXPECT_THAT(tips, ElementsAre("rf1_tip", "rf2_tip", "rf3_tip", "rf4_tip", "lf1_tip", "lf2_tip", "lf3_tip",
                                "lf4_tip"));
}

TEST_F(AssistantRobot, PutsJointsAndMassesInPlaceAtHome) {
  // Heights above the floor: waist 0.75, shoulders 1.13, elbow 0.83, wrist 0.58, palm 0.52, finger base 0.47.
  const std::vector<Landmark> landmarks = {
      {"waist_yaw", {0, 0, 1}, {0, 0, 0.75}, {0, 0, 0.75}},
      // (14 0.19 + 4 0.38 + 0.8 0.47 + 2.5 0.60, forward 2.5 0.01) / 21.3
      {"waist_pitch", {0, 1, 0}, {0, 0, 0.75}, {0.025 / 21.3, 0, 0.75 + 6.056 / 21.3}},
      {"r_shoulder_pitch", {0, 1, 0}, {0, -0.22, 1.13}, {0, -0.22, 1.13}},
      {"r_shoulder_roll", {1, 0, 0}, {0, -0.22, 1.13}, {0, -0.22, 1.08}},
      {"r_upper_arm_yaw", {0, 0, -1}, {0, -0.22, 0.83}, {0, -0.22, 0.94}},
      {"r_elbow", {0, -1, 0}, {0, -0.22, 0.83}, {0, -0.22, 0.705}},
      {"r_wrist_deviation", {1, 0, 0}, {0, -0.22, 0.58}, {0, -0.22, 0.55}},
      {"r_wrist_flexion", {0, -1, 0}, {0, -0.22, 0.52}, {0, -0.22, 0.52}},
      // (0.12 0.015 + 0.45 0.038) / 0.57 below
      {"r_palm_roll", {0, 0, -1}, {0, -0.22, 0.52}, {0, -0.22, 0.52 - 0.0189 / 0.57}},
      {"l_elbow", {0, -1, 0}, {0, 0.22, 0.83}, {0, 0.22, 0.705}},
      {"rf1_1", {1, 0, 0}, {-0.05, -0.192, 0.47}, {-0.05, -0.192, 0.465}},
      {"rf1_2", {0, -1, 0}, {-0.05, -0.192, 0.449}, {-0.05, -0.192, 0.429}},
      {"rf1_3", {0, -1, 0}, {-0.05, -0.192, 0.42047}, {-0.05, -0.192, 0.40047}},
      {"rf1_4", {0, -1, 0}, {-0.05, -0.192, 0.39331}, {-0.05, -0.192, 0.38581}},
      {"lf4_1", {-1, 0, 0}, {0.05, 0.22, 0.47}, {0.05, 0.22, 0.465}},
      {"lf4_2", {0, 1, 0}, {0.05, 0.22, 0.449}, {0.05, 0.22, 0.429}},
  };
  const std::vector<Pose> X_WL = CalcHomePoses(model_);
  for (const Landmark& expected : landmarks) {
    const size_t i = static_cast<size_t>(model_.FindJoint(expected.joint));
    ASSERT_LT(i, X_WL.size()) << expected.joint;
    EXPECT_TRUE(MatrixNear(X_WL[i].linear().col(2), expected.axis, kRounding)) << expected.joint;
    EXPECT_TRUE(MatrixNear(X_WL[i].translation(), expected.origin, kRounding)) << expected.joint;
    EXPECT_TRUE(MatrixNear(X_WL[i] * model_.joints()[i].body.com, expected.com, kRounding)) << expected.joint;
  }
}

TEST(Panda, StandsStraightUpAtHome) {
  const RobotModel model = ReadRobotModel(kParameters / "panda.toml");
  EXPECT_EQ(model.num_positions(), 7);
  EXPECT_EQ(model.num_velocities(), 7);
  EXPECT_EQ(model.base().link, "panda_link0");
  EXPECT_TRUE(model.fingertips().empty());
  // The flange looks down: 0.333 + 0.316 + 0.384 up, 0.088 forward, 0.107 down again.
  const Pose X = CalcHomePose(model, "panda_flange");
  EXPECT_TRUE(MatrixNear(X.translation(), Vector3d(0.088, 0.0, 0.926), kRounding));
  EXPECT_TRUE(MatrixNear(X.linear(), Matrix3d(Vector3d(1.0, -1.0, -1.0).asDiagonal()), kRounding));
}

/// Everything that the shipped files do not use.
constexpr const char* kOtherForms = R"(
name = "other forms"
gravity = ["0", "-1 / 4", "-2 * 4"]
[lengths]
a = 0.5
b = "a / 2"
[base]
type = "planar"
link = "cart"
pose = { xyz = [0, 0, "b"] }
mass = 2
com = [0, 0, "b"]
inertia = [2.0, 3.0, 4.0, 0.1, 0.2, 0.3]
[[chain]]
parent = "cart"
template = "slide"
pose = { rpy_deg = [90, 0, 90] }
rows = [{ joint = "turn", link = "arm", alpha = "pi / 2", a = 0, q = 0.25, d = "-b" }]
[chain.joints]
turn = { range_deg = [-90, 180], damping = 0, armature = 0 }
[chain.links.arm]
shapes = [{ shape = "cylinder", mass = 12, radius = 1, length = 2, axis = [0, 0.6, "-0.8"] }]
[template.slide]
rows = [{ joint = "slide", link = "sled", type = "prismatic", alpha = 0, a = 0, q = 0, d = 0 }]
joints.slide = { range = [0, "a"], damping = 0, armature = 0 }
joints.turn = { range_deg = [0, 1], damping = 1, armature = 1 }
links.sled = { mass = 0, com = [0, 0, 0], inertia = [0, 0, 0, 0, 0, 0] }
[[frame]]
name = "eye"
link = "sled"
rpy = [0, 0, "pi / 2"]
[object]
body = "egg"
shape = "capsule"
radius = 0.5
length = 0.25
mass = 4
inertia = [1, 2, 2.5, 0, 0, 0]
friction = 1
)";

TEST(OtherForms, AreRead) {
  const RobotModel model = ParseRobotModel(kOtherForms, "other.toml");
  EXPECT_EQ(model.gravity(), Vector3d(0.0, -0.25, -8.0));
  EXPECT_EQ(model.num_velocities(), 5);

  // R = Rz(90 deg) Rx(90 deg): x to y, y to z, z to x.
  Matrix3d R;
  R << 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0;
  EXPECT_TRUE(MatrixNear(model.joints().front().X_PB.linear(), R, kRounding));
  EXPECT_EQ(model.base().X_B0.translation(), Vector3d(0.0, 0.0, 0.25));
  Matrix3d I;
  I << 2.0, 0.1, 0.2, 0.1, 3.0, 0.3, 0.2, 0.3, 4.0;
  EXPECT_EQ(model.base().body.inertia, I);

  const Joint& turn = model.joints()[0];
  EXPECT_EQ(turn.mdh.alpha, kPi / 2.0);
  EXPECT_EQ(turn.mdh.q, 0.25);
  EXPECT_EQ(turn.mdh.d, -0.25);
  EXPECT_NEAR(turn.lower, -kPi / 2.0, kRounding);
  EXPECT_NEAR(turn.upper, kPi, kRounding);
  EXPECT_EQ(turn.damping, 0.0);  // The chain's own entry goes before the template's.
  // I = 7 (1 - n n^T) + 6 n n^T with n = (0, 0.6, -0.8).
  const Vector3d n(0.0, 0.6, -0.8);
  EXPECT_TRUE(MatrixNear(turn.body.inertia, 7.0 * Matrix3d::Identity() - n * n.transpose(), 7.0 * kRounding));

  EXPECT_EQ(model.joints()[1].type, JointType::kPrismatic);
  EXPECT_EQ(model.joints()[1].upper, 0.5);
  Matrix3d R_eye;
  R_eye << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  EXPECT_TRUE(MatrixNear(model.frames()[0].X_LF.linear(), R_eye, kRounding));
  EXPECT_EQ(std::get<SolidCapsule>(model.object()->shape).length, 0.25);
  EXPECT_EQ(model.object()->body.inertia, Matrix3d(Vector3d(1.0, 2.0, 2.5).asDiagonal()));
}

}  // namespace
}  // namespace dexcheck::testing::parameter_reader_test
