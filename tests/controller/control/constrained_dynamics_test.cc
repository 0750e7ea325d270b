// (45) to (49): the rigid system of robot and object.

#include "controller/control/constrained_dynamics.h"

#include <gtest/gtest.h>

#include <random>

#include "controller/common/errors.h"
#include "controller/model/platform.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"
#include "tests/controller/control/grasp_scene.h"

namespace dexcheck::testing::constrained_dynamics_test {
namespace {

// Measured 1.4e-13 with forces of up to 100 N, and 2e-11 with accelerations of up to 8000 rad/s^2 (fingers of
// 1e-5 kg m^2 are pushed).
constexpr double kForceRounding = 1e-12;
constexpr double kAccelerationRounding = 2e-10;

/// Residuals of (48), (19) and (46).
struct Balance {
  Balance(const ModelTerms& robot, const GraspTerms& grasp, const VectorXd& force, const Prediction& p)
      : robot_residual(robot.M() * p.xi_dot + robot.C() * robot.velocity() + robot.gravity() +
                       robot.friction() + grasp.J_B().transpose() * p.f_c - force),
        object_residual(grasp.body().M_hat * p.V_Bo_dot + grasp.body().C_hat * grasp.V_Bo() +
                        grasp.body().N_o - grasp.G() * p.f_c),
        contact_residual(grasp.J_B_dot() * robot.velocity() + grasp.J_B() * p.xi_dot -
                         grasp.G_dot().transpose() * grasp.V_Bo() - grasp.G().transpose() * p.V_Bo_dot) {}
  VectorXd robot_residual, object_residual, contact_residual;
};

class PredictionTest : public ::testing::TestWithParam<Hands> {
 protected:
  /// Velocities and forces at random, and what the whole system answers with.
  const Prediction& Draw(std::mt19937* random) {
    scene_.DrawVelocities(random, 1.0);
    force_ = DrawVector(scene_.robot.size(), 0.2, random);
    return dynamics_.Predict(scene_.robot, scene_.grasp, force_);
  }
  GraspScene scene_{GetParam()};
  ConstrainedDynamics dynamics_{scene_.model, scene_.grasp.num_contacts()};
  VectorXd force_;
};

TEST_P(PredictionTest, SatisfiesAllThreeEquations) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 10; ++trial) {
    const Prediction& p = Draw(&random);
    ASSERT_GT(p.f_c.norm(), 0.1);
    ASSERT_GT(p.xi_dot.norm(), 1.0);
    ASSERT_GT(scene_.grasp.slip_bias().norm(), 0.1);
    const Balance balance(scene_.robot, scene_.grasp, force_, p);
    EXPECT_TRUE(MatrixNear(balance.robot_residual, VectorXd::Zero(scene_.robot.size()), kForceRounding));
    EXPECT_TRUE(MatrixNear(balance.object_residual, Vector6d::Zero(), kForceRounding));
    EXPECT_TRUE(
        MatrixNear(balance.contact_residual, VectorXd::Zero(scene_.num_forces()), kAccelerationRounding));
  }
}

std::string NameHands(const ::testing::TestParamInfo<Hands>& info) {
  return info.param == Hands::kRight ? "RightHand" : info.param == Hands::kLeft ? "LeftHand" : "BothHands";
}

INSTANTIATE_TEST_SUITE_P(Hands, PredictionTest, ::testing::Values(Hands::kRight, Hands::kLeft, Hands::kBoth),
                         NameHands);

// Three slides along y, z, x carry a fingertip of mass m_1 against a ball of mass m_2, line of centres x:
// both move at a = F / (m_1 + m_2), and m_2 a passes between them.
TEST(ConstrainedDynamics, OneFingerPushesABall) {
  RobotSpec spec;
  spec.name = "gantry";
  spec.gravity.setZero();
  const MassProperties link{0.0, Vector3d::Zero(), Matrix3d::Zero()};
  const auto slide = [&](const char* name, int parent, double alpha, double theta, double mass) {
    Joint joint;
    joint.name = name;
    joint.link = std::string(name) + "_link";
    joint.parent = parent;
    joint.type = JointType::kPrismatic;
    joint.mdh = {alpha, 0.0, theta, 0.0};
    joint.lower = -1.0;
    joint.upper = 1.0;
    joint.body = link;
    joint.body.mass = mass;
    joint.body.inertia = 1e-3 * Matrix3d::Identity();
    spec.joints.push_back(joint);
  };
  slide("first", -1, 0.0, 0.0, 1.0);
  slide("second", 0, kPi / 2.0, kPi / 2.0, 2.0);
  slide("third", 1, kPi / 2.0, 0.0, 3.0);
  spec.frames.push_back({"tip", 2, Pose::Identity(), 0.01});
  const RobotModel model(spec);
  const MassProperties ball = CalcMassProperties(SolidSphere{0.05}, 0.5, Pose::Identity());
  const Sphere surface(0.05);
  ModelTerms robot(model);
  robot.SetState(Vector3d::Zero(), Vector3d::Zero());
  robot.CalcDynamics();
  GraspTerms grasp(model, model.fingertips(), ball, surface);
  // The ball 0.06 m from the tip along the third slide.
  const Vector3d direction = robot.CalcFramePose(0).linear().col(2);
  Pose X_Bo = Pose::Identity();
  X_Bo.translation() = robot.CalcFramePose(0).translation() + 0.06 * direction;
  const FoundContact found = FindContact(grasp.tip(0), surface, X_Bo.inverse() * robot.CalcFramePose(0));
  ASSERT_NEAR(found.gap, 0.0, 1e-15);
  grasp.SetPose(robot, X_Bo, Vector6d::Zero(), {&found.kappa, 1});
  ConstrainedDynamics dynamics(model, 1);
  constexpr double kPush = 7.0;
  const Prediction& p = dynamics.Predict(robot, grasp, Vector3d(0.0, 0.0, kPush));
  const double a = kPush / (3.0 + 0.5);
  // Forces of 1 N turn the ball at 100 rad/s^2: eps times that.
  constexpr double kTolerance = 1e-13;
  EXPECT_TRUE(MatrixNear(p.xi_dot, Vector3d(0.0, 0.0, a), kTolerance));
  EXPECT_TRUE(MatrixNear(p.f_c, Vector3d(0.0, 0.0, 0.5 * a), kTolerance));
  EXPECT_TRUE(MatrixNear(p.V_Bo_dot.head<3>(), a * direction, kTolerance));
  EXPECT_TRUE(MatrixNear(p.V_Bo_dot.tail<3>(), Vector3d::Zero(), kTolerance));
  EXPECT_TRUE(Throws<std::logic_error>([&] { return grasp.X_o(); }, "set by a pose"));

  // The first slide carries all three links and drags the ball sideways: friction at the contact, arm 0.05 m,
  // turns it as well: a_ball = f/m, tip = a_ball + 0.05 (0.05 f / I).
  const Prediction& s = dynamics.Predict(robot, grasp, Vector3d(kPush, 0.0, 0.0));
  const double inertia = ball.inertia(0, 0);
  const double compliance = 1.0 / 0.5 + 0.05 * 0.05 / inertia;
  const double f = kPush / (1.0 + 6.0 * compliance);
  EXPECT_NEAR(s.f_c.norm(), f, kTolerance);
  EXPECT_NEAR(s.f_c[2], 0.0, kTolerance);
  EXPECT_TRUE(MatrixNear(s.xi_dot, Vector3d((kPush - f) / 6.0, 0.0, 0.0), kTolerance));
}

TEST(ConstrainedDynamics, RejectsContactsThatDependOnEachOther) {
  GraspScene scene;
  const std::vector<int> twice = {scene.fingertips[0], scene.fingertips[0]};
  GraspTerms grasp(scene.model, twice, scene.object, scene.surface);
  const std::vector<ContactCoordinates> kappa = {scene.kappa[0], scene.kappa[0]};
  grasp.SetState(scene.robot, scene.X_o, scene.X_o_dot, kappa);
  ConstrainedDynamics dynamics(scene.model, 2);
  const VectorXd force = VectorXd::Zero(scene.robot.size());
  EXPECT_TRUE(Throws<SingularityError>([&] { return dynamics.Predict(scene.robot, grasp, force); },
                                       "contact constraints depend on each other"));
}

// E_bar' = diag(S_v^T E_v, 1), for both choices of v.
TEST(ActuationMap, IsEBar) {
  for (const DriveVelocity velocity : {DriveVelocity::kTwist, DriveVelocity::kWheelRates}) {
    const RobotModel model = ReadPaperRobot(velocity);
    const ActuationMap actuation(model);
    std::mt19937 random(7);
    const VectorXd tau = DrawVector(model.num_velocities(), 0.2, &random);
    MatrixXd E_bar = MatrixXd::Identity(tau.size(), tau.size());
    E_bar.topLeftCorner<2, 2>() =
        CalcPlatformConstraint(model.base(), Vector3d(0.1, 0.2, 0.3), Vector2d(0.4, 0.5)).S_v_T_E_v;
    VectorXd force(tau.size());
    actuation.CalcForce(tau, force);
    EXPECT_TRUE(MatrixNear(force, E_bar * tau, 1e-15));
    actuation.CalcTorque(force, force);
    EXPECT_TRUE(MatrixNear(force, tau, 1e-15));
  }
}

}  // namespace
}  // namespace dexcheck::testing::constrained_dynamics_test
