#include "controller/model/robot_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "controller/common/errors.h"
#include "tests/common/matchers.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::robot_model_test {
namespace {

const double kNaN = std::numeric_limits<double>::quiet_NaN();

Joint MakeJoint(const std::string& name, int parent) {
  Joint joint;
  joint.name = name;
  joint.link = "link_" + name;
  joint.parent = parent;
  joint.lower = -1.0;
  joint.upper = 1.0;
  joint.body = CalcMassProperties(SolidSphere{0.1}, 1.0, Pose::Identity());
  return joint;
}

/// Two branches from the base, the first of which branches again:
///   base -> a -> c -> f
///             -> e
///        -> b -> d
RobotSpec MakeTree() {
  RobotSpec spec;
  spec.name = "tree";
  spec.source = "tree.toml";
  spec.base.type = BaseType::kDifferentialDrive;
  spec.base.link = "platform";
  spec.base.wheel_radius = 0.1;
  spec.base.wheel_distance = 0.5;
  spec.base.wheel_joint_right = "right";
  spec.base.wheel_joint_left = "left";
  spec.base.wheel = {2.0, 0.01, 0.006, 0.0, 0.0};
  spec.base.body = {10.0, Vector3d(0.1, 0.0, 0.2), Vector3d(1.0, 1.5, 2.0).asDiagonal()};
  spec.joints = {MakeJoint("a", -1), MakeJoint("b", -1), MakeJoint("c", 0),
                 MakeJoint("d", 1),  MakeJoint("e", 0),  MakeJoint("f", 2)};
  spec.frames = {{"camera", -1, Pose::Identity(), std::nullopt},
                 {"tip_f", 5, Pose::Identity(), 0.01},
                 {"tip_d", 3, Pose::Identity(), 0.02}};
  spec.object =
      ObjectModel{"ball", SolidSphere{0.1}, CalcMassProperties(SolidSphere{0.1}, 1.0, Pose::Identity()), 0.5};
  return spec;
}

TEST(RobotModel, OrdersBranchesDepthFirst) {
  const RobotModel model(MakeTree());
  EXPECT_THAT(model.depth_first(), ElementsAre(0, 2, 5, 4, 1, 3));  // a c f e b d
  std::vector<int> depths;
  for (int i = 0; i < model.num_joints(); ++i) depths.push_back(model.depth(i));
  EXPECT_THAT(depths, ElementsAre(1, 1, 2, 2, 2, 3));
  EXPECT_EQ(model.max_depth(), 3);
}

TEST(RobotModel, CountsCoordinates) {
  RobotSpec spec = MakeTree();
  EXPECT_EQ(RobotModel(spec).num_positions(), 9);
  EXPECT_EQ(RobotModel(spec).num_velocities(), 8);
  spec.base.type = BaseType::kPlanar;
  EXPECT_EQ(RobotModel(spec).num_positions(), 9);
  EXPECT_EQ(RobotModel(spec).num_velocities(), 9);
  spec.base.type = BaseType::kFixed;
  EXPECT_EQ(RobotModel(spec).num_positions(), 6);
  EXPECT_EQ(RobotModel(spec).num_velocities(), 6);
}

TEST(RobotModel, FindsByName) {
  const RobotModel model(MakeTree());
  EXPECT_EQ(model.FindJoint("d"), 3);
  EXPECT_EQ(model.FindJoint("right"), -1);
  EXPECT_EQ(model.FindLink("link_d"), 3);
  EXPECT_EQ(model.FindLink("platform"), -1);
  EXPECT_EQ(model.link_name(3), "link_d");
  EXPECT_EQ(model.link_name(-1), "platform");
  EXPECT_EQ(model.FindFrame("tip_d"), 2);
  EXPECT_THAT(model.fingertips(), ElementsAre(1, 2));
  EXPECT_THROW((void)model.FindLink("d"), std::invalid_argument);
  EXPECT_THROW((void)model.FindFrame("d"), std::invalid_argument);
}

TEST(RobotModel, AddsTheWheelsToTheBase) {
  // By hand: m = 10 + 2 + 2, com = 10/14 (0.1, 0, 0.2). About the axle's midpoint, with wheels at y = +-0.25:
  //   base   I_xx = 1 + 10 0.04, I_yy = 1.5 + 10 (0.01 + 0.04), I_zz = 2 + 10 0.01, I_xz = -10 0.1 0.2
  //   wheels I_xx = 2 (0.006 + 2 0.0625), I_yy = 2 0.01, I_zz = I_xx
  // and then to the centre of mass: I - m (c^2 1 - c c^T).
  const double kRounding = 1e-14;  // Some twenty roundings of numbers of order 1.
  const RobotModel model(MakeTree());
  const MassProperties& body = model.base_with_wheels();
  const Vector3d c(1.0 / 14.0, 0.0, 2.0 / 14.0);
  Matrix3d I;
  I << 1.4 + 0.262, 0.0, -0.2, 0.0, 2.0 + 0.02, 0.0, -0.2, 0.0, 2.1 + 0.262;
  I -= 14.0 * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
  EXPECT_EQ(body.mass, 14.0);
  EXPECT_TRUE(MatrixNear(body.com, c, kRounding));
  EXPECT_TRUE(MatrixNear(body.inertia, I, kRounding));
}

struct BadSpec {
  std::string name;
  std::function<void(RobotSpec&)> spoil;
  std::string message;
};

TEST(RobotModel, RejectsWithOneLineThatNamesTheValue) {
  const std::vector<BadSpec> kBad = {
      {"Gravity", [](RobotSpec& s) { s.gravity.z() = kNaN; }, "gravity: must be finite, got nan"},
      {"JointName", [](RobotSpec& s) { s.joints[2].name = "b"; },
       R"(joint "b": name: must be unique, got "b" again)"},
      {"WheelName", [](RobotSpec& s) { s.joints[2].name = "left"; },
       R"(joint "left": name: must be unique, got "left" again)"},
      {"LinkName", [](RobotSpec& s) { s.joints[2].link = "platform"; },
       R"(joint "c": link: must be unique, got "platform" again)"},
      {"FrameName", [](RobotSpec& s) { s.frames[2].name = "camera"; },
       R"(frame "camera": name: must be unique, got "camera" again)"},
      {"LaterParent", [](RobotSpec& s) { s.joints[2].parent = 5; },
       R"(joint "c": parent: must be -1 (the base) or an earlier joint than 2, got 5)"},
      {"Range", [](RobotSpec& s) { s.joints[1].lower = 2.0; },
       R"(joint "b": range: lower limit must not exceed upper limit 1, got 2)"},
      {"Mdh", [](RobotSpec& s) { s.joints[1].mdh.alpha = kNaN; },
       R"(joint "b": alpha: must be finite, got nan)"},
      {"Pose", [](RobotSpec& s) { s.joints[1].X_PB.translation().y() = kNaN; },
       R"(joint "b": pose: must be finite, got nan)"},
      {"Reflection", [](RobotSpec& s) { s.joints[1].X_PB.linear() *= -1.0; },
       R"(joint "b": pose: must be a right-handed rotation, det R = 1, got -1)"},
      {"Scaling", [](RobotSpec& s) { s.joints[1].X_PB.linear()(0, 0) = 2.0; },
       R"(joint "b": pose: must be a rotation, |R^T R - I| = 0, got 3)"},
      {"Damping", [](RobotSpec& s) { s.joints[1].damping = -0.5; },
       R"(joint "b": damping: must be finite and not negative, got -0.5)"},
      {"Mass", [](RobotSpec& s) { s.joints[1].body.mass = -2.0; },
       R"(link "link_b": mass must be finite and not negative, got -2)"},
      {"FrameLink", [](RobotSpec& s) { s.frames[1].link = 6; },
       R"(frame "tip_f": link: must be -1 (the base) or the index of a joint, got 6)"},
      {"FingertipRadius", [](RobotSpec& s) { s.frames[1].sphere_radius = 0.0; },
       R"(frame "tip_f": sphere_radius: must be finite and positive, got 0)"},
      {"WheelRadius", [](RobotSpec& s) { s.base.wheel_radius = 0.0; },
       "base.wheel_radius: must be finite and positive, got 0"},
      {"WheelInertia", [](RobotSpec& s) { s.base.wheel.spin_inertia = 1.0; },
       "base.wheels: principal moments of inertia must satisfy the triangle "
       "inequality, got [0.006, 0.006, 1]"},
      {"BaseMass", [](RobotSpec& s) { s.base.body.mass = kNaN; },
       "base: mass must be finite and not negative, got nan"},
      {"ObjectFriction", [](RobotSpec& s) { s.object->friction = 0.0; },
       "object.friction: must be finite and positive, got 0"},
      {"ObjectCentre", [](RobotSpec& s) { s.object->body.com.x() = 0.5; },
       "object.com: must be the origin of the object's frame, distance 0, got 0.5"},
  };
  for (const BadSpec& bad : kBad) {
    SCOPED_TRACE(bad.name);
    RobotSpec spec = MakeTree();
    bad.spoil(spec);
    EXPECT_EQ(MessageOf<InputError>([&] { return RobotModel(spec); }), "tree.toml: " + bad.message);
  }
}

}  // namespace
}  // namespace dexcheck::testing::robot_model_test
