// Three robots whose equations of motion fit on a page: a planar arm with two joints, a pendulum on a cart,
// and the platform of section 2.1 alone. Everything below is worked out by hand.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "controller/dynamics/model_terms.h"
#include "tests/common/matrix_near.h"

namespace dexcheck::testing::worked_examples_test {
namespace {

// A dozen operations on numbers up to 50; measured 2.3e-15.
constexpr double kRounding = 2e-14;
// A wrong formula must miss by far more.
constexpr double kVisible = 1e-2;

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

// A cart of mass m_c slides along y; from it hangs a pendulum of mass m_p at distance l, inertia I, that
// turns about x. At q = 0 it hangs straight down; its centre of mass is (0, y + l sin(theta), -l cos(theta)).
constexpr double km_c = 3.0, km_p = 0.8;
constexpr double kl = 0.35, kI = 0.015;

RobotSpec MakeCartPole() {
  RobotSpec spec;
  spec.name = "pendulum on a cart";
  spec.source = "pendulum on a cart";
  // Rot(x, -90) turns z to y; Rot(z, 90) then turns x downward, and Rot(x, 90) the next z to x.
  const MdhRow cart{.alpha = -kPi / 2, .q = kPi / 2};
  const MdhRow pole{.alpha = kPi / 2};
  spec.joints.push_back(MakeJoint(0, JointType::kPrismatic, cart, km_c, {0.02, 0.03, 0.04}, 0.1));
  spec.joints.push_back(MakeJoint(1, JointType::kRevolute, pole, km_p, {kl, 0.0, 0.0}, kI));
  return spec;
}

TEST(CartPole, AgreesWithTheClosedForm) {
  const RobotModel model(MakeCartPole());
  for (const double theta : {0.0, 0.6, -2.2, 3.1}) {
    const Vector2d q(0.4, theta);
    const Vector2d q_dot(-0.6, 1.7);
    const ModelTerms terms = Evaluate(model, q, q_dot);
    // T = 1/2 (m_c + m_p) y_dot^2 + m_p l cos(theta) y_dot theta_dot + 1/2 (I + m_p l^2) theta_dot^2
    const double c = km_p * kl * std::cos(theta);
    const double s = km_p * kl * std::sin(theta);
    EXPECT_TRUE(MatrixNear(terms.M(), Matrix2d{{km_c + km_p, c}, {c, kI + km_p * kl * kl}}, kRounding));
    // dM12/dtheta = -s is all that changes: C = [0, -s theta_dot; 0, 0].
    EXPECT_TRUE(MatrixNear(terms.C(), Matrix2d{{0.0, -s * q_dot[1]}, {0.0, 0.0}}, kRounding));
    // V = -m_p g l cos(theta)
    EXPECT_TRUE(MatrixNear(terms.gravity(), Vector2d(0.0, kG * s), kRounding));
    EXPECT_TRUE(MatrixNear(terms.CalcLinkPose(1) * Vector3d(kl, 0.0, 0.0),
                           Vector3d(0.0, q[0] + kl * std::sin(theta), -kl * std::cos(theta)), kRounding));
  }
}

// The platform alone: total mass m with the wheels, centre of mass at (c_x, c_y) of Sigma_0, inertia I_z
// about the vertical through it; wheels of spin inertia I_s (rotor included) at +-b/2.
constexpr double kr = 0.1;
constexpr double kb = 0.4;

RobotSpec MakePlatform(DriveVelocity velocity) {
  RobotSpec spec;
  spec.name = "platform";
  spec.source = "platform";
  spec.base.type = BaseType::kDifferentialDrive;
  spec.base.velocity = velocity;
  spec.base.wheel_radius = kr;
  spec.base.wheel_distance = kb;
  spec.base.wheel = {1.5, 0.0075, 0.004, 0.0025, 0.02};
  spec.base.wheel_joint_right = "right";
  spec.base.wheel_joint_left = "left";
  spec.base.body = {20.0, {0.115, -0.0575, 0.2}, Vector3d(0.5, 0.6, 0.7).asDiagonal()};
  return spec;
}

TEST(Platform, AgreesWithTheClosedForm) {
  const RobotModel model(MakePlatform(DriveVelocity::kTwist));
  const double m = 23.0;     // 20 + 2 * 1.5
  const double c_x = 0.1;    // 20 * 0.115 / 23
  const double c_y = -0.05;  // 20 * -0.0575 / 23
  const double I_s = 0.01;   // 0.0075 + 0.0025
  // About Sigma_0's z axis: 0.7 + 20 (0.115^2 + 0.0575^2) + 2 (0.004 + 1.5 * 0.2^2)
  const double I_0 = 0.7 + 0.330625 + 0.128;
  const double v_c = 0.9;
  const double w_c = -1.4;
  const ModelTerms terms = Evaluate(model, Vector3d(2.0, -1.0, 0.8), Vector2d(v_c, w_c));
  // The centre of mass moves with (v_c - c_y w_c, c_x w_c) in Sigma_0; the wheels turn with
  // (v_c +- w_c b/2) / r:
  //   M_bar' = [m + 2 I_s/r^2, -m c_y; -m c_y, I_0 + I_s b^2 / (2 r^2)]
  const Matrix2d M_bar{{m + 2.0 * I_s / (kr * kr), -m * c_y},
                       {-m * c_y, I_0 + I_s * kb * kb / (2.0 * kr * kr)}};
  EXPECT_TRUE(MatrixNear(terms.M(), M_bar, kRounding));
  // C_bar' has the centripetal force of the centre of mass along x, and the moment of the force that acts at
  // x = c_x. From (14): the (v, w) entry is S_v^T C_v S_v, the (w, v) entry S_v^T M_v S_v_dot.
  //   C_bar' = m c_x w_c [0, -1; 1, 0]
  const Matrix2d C_bar{{0.0, -m * c_x * w_c}, {m * c_x * w_c, 0.0}};
  EXPECT_TRUE(MatrixNear(terms.C(), C_bar, kRounding));
  EXPECT_TRUE(MatrixNear(terms.gravity(), Vector2d::Zero(), kRounding));
  // The wheels' friction 0.02 N m s/rad at (0.9 +- 1.4 * 0.2) / 0.1 rad/s, on v_c and w_c.
  const double rate_r = (v_c + 0.2 * w_c) / kr;
  const double rate_l = (v_c - 0.2 * w_c) / kr;
  const Vector2d friction(0.02 * (rate_r + rate_l) / kr, 0.02 * (rate_r - rate_l) * 0.2 / kr);
  EXPECT_TRUE(MatrixNear(terms.friction(), friction, kRounding));

  // Without the offset of the centre of mass nothing couples; without spin M_bar' is lighter.
  EXPECT_GT(std::abs(terms.M()(0, 1)), kVisible);
  EXPECT_GT(std::abs(terms.C()(0, 1)), kVisible);
  RobotSpec still = MakePlatform(DriveVelocity::kTwist);
  still.base.wheel.armature = 0.0;
  const RobotModel still_model(still);
  const ModelTerms lighter = Evaluate(still_model, Vector3d(2.0, -1.0, 0.8), Vector2d(v_c, w_c));
  EXPECT_GT(terms.M()(0, 0) - lighter.M()(0, 0), kVisible);
}

}  // namespace
}  // namespace dexcheck::testing::worked_examples_test
