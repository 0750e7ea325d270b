// The equations of motion of a planar arm with two joints, worked out by hand.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "controller/dynamics/model_terms.h"
#include "tests/common/matrix_near.h"

namespace dexcheck::testing::worked_examples_test {
namespace {

// A dozen operations on numbers up to 50; measured 2.3e-15.
constexpr double kRounding = 2e-14;
constexpr double kG = 9.81;

/// A joint of a chain whose link has its mass at com, and an inertia about every axis through it.
Joint MakeJoint(int index, JointType type, const MdhRow& mdh, double mass, const Vector3d& com,
                double inertia) {
  Joint joint;
  joint.name = "joint_" + std::to_string(index);
  joint.link = "link_" + std::to_string(index);
  joint.parent = index - 1;
  joint.type = type;
  joint.mdh = mdh;
  joint.lower = -10.0;
  joint.upper = 10.0;
  joint.body = {mass, com, inertia * Matrix3d::Identity()};
  return joint;
}

ModelTerms Evaluate(const RobotModel& model, const VectorXd& q, const VectorXd& velocity,
                    Coordinates coordinates = Coordinates::kReduced) {
  ModelTerms terms(model, coordinates);
  terms.SetState(q, velocity);
  terms.CalcDynamics();
  return terms;
}

// The arm lies in the vertical x-y plane, its joints along z; gravity points along -y. Link i has length l_i,
// mass m_i at c_i along x, inertia I_i, rotor inertia A_i and friction d_i.
constexpr double kl1 = 0.5;
constexpr double kc1 = 0.2, kc2 = 0.3;
constexpr double km1 = 2.0, km2 = 1.0;
constexpr double kI1 = 0.04, kI2 = 0.02;
constexpr double kA1 = 0.01, kA2 = 0.005;
constexpr double kd1 = 0.3, kd2 = 0.1;

RobotSpec MakeTwoLinkArm() {
  RobotSpec spec;
  spec.name = "two-link arm";
  spec.source = "two-link arm";
  spec.gravity = Vector3d(0.0, -kG, 0.0);
  spec.joints.push_back(MakeJoint(0, JointType::kRevolute, {}, km1, {kc1, 0.0, 0.0}, kI1));
  spec.joints.push_back(MakeJoint(1, JointType::kRevolute, {.a = kl1}, km2, {kc2, 0.0, 0.0}, kI2));
  spec.joints[0].armature = kA1;
  spec.joints[1].armature = kA2;
  spec.joints[0].damping = kd1;
  spec.joints[1].damping = kd2;
  return spec;
}

TEST(TwoLinkArm, AgreesWithTheClosedForm) {
  const RobotModel model(MakeTwoLinkArm());
  for (const Vector2d& q :
       {Vector2d(0.0, 0.0), Vector2d(0.4, 1.1), Vector2d(-2.0, -0.7), Vector2d(3.0, 2.9)}) {
    const Vector2d q_dot(0.7, -1.3);
    const ModelTerms terms = Evaluate(model, q, q_dot);
    const double c2 = std::cos(q[1]);
    const double s2 = std::sin(q[1]);
    // Link 2's centre of mass is at l1 e(q1) + c2 e(q1 + q2):
    //   T = 1/2 (I1 + m1 c1^2 + m2 l1^2) q1_dot^2 + 1/2 (I2 + m2 c2^2) (q1_dot + q2_dot)^2
    //       + m2 l1 c2 cos(q2) q1_dot (q1_dot + q2_dot) + 1/2 A1 q1_dot^2 + 1/2 A2 q2_dot^2
    const double outer = kI2 + km2 * kc2 * kc2;
    const double coupling = km2 * kl1 * kc2 * c2;
    Matrix2d M;
    M << kI1 + km1 * kc1 * kc1 + km2 * kl1 * kl1 + outer + 2.0 * coupling + kA1, outer + coupling,
        outer + coupling, outer + kA2;
    // Only d/dq2 is not zero: dM11 = -2 h', dM12 = -h', h' = m2 l1 c2 sin(q2). Christoffel symbols:
    //   C = h' [-q2_dot, -(q1_dot + q2_dot); q1_dot, 0]
    const double h = km2 * kl1 * kc2 * s2;
    Matrix2d C;
    C << -h * q_dot[1], -h * (q_dot[0] + q_dot[1]), h * q_dot[0], 0.0;
    // V = g (m1 c1 + m2 l1) sin(q1) + g m2 c2 sin(q1 + q2)
    const double g2 = km2 * kc2 * kG * std::cos(q[0] + q[1]);
    const Vector2d gravity((km1 * kc1 + km2 * kl1) * kG * std::cos(q[0]) + g2, g2);
    EXPECT_TRUE(MatrixNear(terms.M(), M, kRounding));
    EXPECT_TRUE(MatrixNear(terms.C(), C, kRounding));
    EXPECT_TRUE(MatrixNear(terms.gravity(), gravity, kRounding));
    EXPECT_TRUE(MatrixNear(terms.friction(), Vector2d(kd1 * q_dot[0], kd2 * q_dot[1]), kRounding));
  }
}

}  // namespace
}  // namespace dexcheck::testing::worked_examples_test
