#include "tests/common/random_robot.h"

namespace dexcheck::testing {
namespace {

double Draw(std::mt19937* random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(*random);
}

Vector3d DrawVector(std::mt19937* random, double size) {
  return {Draw(random, -size, size), Draw(random, -size, size), Draw(random, -size, size)};
}

Matrix3d DrawRotation(std::mt19937* random) {
  Eigen::Quaterniond rotation(Draw(random, -1, 1), Draw(random, -1, 1), Draw(random, -1, 1),
                              Draw(random, -1, 1));
  return rotation.normalized().toRotationMatrix();
}

MassProperties DrawBody(std::mt19937* random) {
  // Second moments d >= 0 give principal moments (d2 + d3, ...) that obey the triangle inequality.
  const Vector3d d(Draw(random, 0.001, 0.02), Draw(random, 0.001, 0.02), Draw(random, 0.001, 0.02));
  const Vector3d moments(d[1] + d[2], d[2] + d[0], d[0] + d[1]);
  const Matrix3d R = DrawRotation(random);
  const Matrix3d inertia = R * moments.asDiagonal() * R.transpose();
  return {Draw(random, 0.3, 3.0), DrawVector(random, 0.2), 0.5 * (inertia + inertia.transpose())};
}

}  // namespace

RobotSpec MakeRandomRobot(const RandomRobotOptions& options, std::mt19937* random) {
  RobotSpec spec;
  spec.name = "random";
  spec.source = "random robot";
  Base& base = spec.base;
  base.type = options.base;
  base.velocity = options.velocity;
  base.body = DrawBody(random);
  base.body.mass *= 10.0;
  base.body.inertia *= 10.0;
  if (base.type == BaseType::kFixed) {
    base.X_B0.linear() = DrawRotation(random);
    base.X_B0.translation() = DrawVector(random, 0.5);
  } else {
    if (base.type != BaseType::kFloating) base.X_B0.translation().z() = 0.12;
    spec.gravity = Vector3d(0.3, -0.4, -9.7);
  }
  if (base.type == BaseType::kDifferentialDrive) {
    base.wheel_radius = 0.12;
    base.wheel_distance = 0.43;
    base.wheel = {1.3, 0.011, 0.007, 0.004, 0.03};
    base.wheel_joint_right = "wheel_right";
    base.wheel_joint_left = "wheel_left";
  }
  std::vector<bool> is_leaf;
  for (int i = 0; i < options.joints; ++i) {
    Joint joint;
    joint.name = "joint_" + std::to_string(i);
    joint.link = "link_" + std::to_string(i);
    joint.parent = i - 1;
    if (i > 0 && Draw(random, 0.0, 1.0) < options.branching) {
      joint.parent = std::uniform_int_distribution<int>(0, i)(*random) - 1;
    }
    if (Draw(random, 0.0, 1.0) < options.prismatic) joint.type = JointType::kPrismatic;
    const bool is_ball = options.ball > 0.0 && Draw(random, 0.0, 1.0) < options.ball;
    if (Draw(random, 0.0, 1.0) < options.offset) {
      joint.X_PB.linear() = DrawRotation(random);
      joint.X_PB.translation() = DrawVector(random, 0.1);
    }
    joint.mdh = {Draw(random, -kPi, kPi), Draw(random, -0.2, 0.2), Draw(random, -kPi, kPi),
                 Draw(random, -0.2, 0.2)};
    const double half_range = joint.type == JointType::kRevolute ? 2.5 : 0.2;
    joint.lower = -half_range;
    joint.upper = half_range;
    joint.damping = Draw(random, 0.01, 0.5);
    joint.armature = Draw(random, 0.001, 0.05);
    joint.body = DrawBody(random);
    if (joint.parent >= 0) is_leaf[static_cast<size_t>(joint.parent)] = false;
    if (is_ball) {
      joint.lower = 0.0;
      joint.X_PB.linear() = DrawRotation(random);
      joint.X_PB.translation() = DrawVector(random, 0.3);
      joint.mdh = MdhRow{};
      joint.type = JointType::kBall;
    }
    is_leaf.push_back(true);
    spec.joints.push_back(joint);
  }
  for (size_t i = 0; i < is_leaf.size(); ++i) {
    if (!is_leaf[i]) continue;
    Frame frame;
    frame.name = "tip_" + std::to_string(i);
    frame.link = static_cast<int>(i);
    frame.X_LF.linear() = DrawRotation(random);
    frame.X_LF.translation() = DrawVector(random, 0.1);
    spec.frames.push_back(frame);
  }
  return spec;
}

VectorXd DrawPositions(const RobotModel& model, std::mt19937* random) {
  VectorXd q(model.num_positions());
  const int offset = model.num_base_positions();
  if (offset == 7) {
    for (int i = 0; i < 7; ++i) q[i] = Draw(random, -2.0, 2.0);
    q.segment<4>(3).normalize();
  }
  if (offset == 3) q.head<3>() << Draw(random, -2, 2), Draw(random, -2, 2), Draw(random, -kPi, kPi);
  for (int i = 0; i < model.num_joints(); ++i) {
    const Joint& joint = model.joint(i);
    const int at = model.position_index(i);
    if (joint.type != JointType::kBall) {
      q[at] = Draw(random, joint.lower, joint.upper);
    } else {
      const Vector3d axis = DrawVector(random, 1.0).normalized();
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(Draw(random, 0.0, joint.upper), axis));
      q.segment<4>(at) << turn.w(), turn.x(), turn.y(), turn.z();
    }
  }
  return q;
}

VectorXd DrawVelocities(int size, std::mt19937* random) {
  VectorXd velocity(size);
  for (double& rate : velocity) rate = Draw(random, -2.0, 2.0);
  return velocity;
}

}  // namespace dexcheck::testing
