// (45) to (52): the rigid system of robot and object.

#include "controller/control/constrained_dynamics.h"

#include <gtest/gtest.h>

#include <random>

#include "controller/common/errors.h"
#include "controller/control/actuation.h"
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

VectorXd DrawForce(int n, std::mt19937* random) {
  std::normal_distribution<double> normal(0.0, 0.1);
  VectorXd force(n);
  for (double& entry : force) entry = normal(*random);
  return force;
}

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

/// M_tilde X_o_ddot + C_tilde X_o_dot + N_tilde = G J_B'^+T E_bar' tau', (52), with the null-space motions
/// sigma and sigma' (n) of (47). N' sigma'' is left out: N' = 0 for J_B' of full row rank.
struct ObjectSpaceTerms {
  Matrix6d M_tilde;
  Matrix6d C_tilde;
  Vector6d N_tilde;
  Matrix6Xd G_J_T;  // G J_B'^+T (6 x n), (50)
};

ObjectSpaceTerms CalcObjectSpaceTerms(const ModelTerms& robot, const GraspTerms& grasp,
                                      const Pseudoinverse& J_B_pinv, const Eigen::Ref<const VectorXd>& sigma,
                                      const Eigen::Ref<const VectorXd>& sigma_prime) {
  const ObjectTerms& o = grasp.coordinates();
  const MatrixXd J_plus = J_B_pinv.CalcMatrix();
  const MatrixXd N = J_B_pinv.CalcProjector();
  // H = J_B'^+ G^T
  const MatrixXd H = J_plus * grasp.G().transpose();
  const MatrixXd H_P_inv = H * o.P_inv;
  const VectorXd N_sigma = N * sigma;

  ObjectSpaceTerms terms;
  terms.G_J_T = H.transpose();
  // M_tilde = M_o + G J^+T M_bar' J^+ G^T P^-1
  terms.M_tilde = o.M_o + terms.G_J_T * robot.M() * H_P_inv;
  // C_tilde = C_o + G J^+T (M_bar' J^+ (G_dot^T P^-1 + G^T d/dt(P^-1) - J_dot J^+ G^T P^-1) + C_bar' J^+ G^T
  // P^-1)
  const MatrixXd H_rate = J_plus * (grasp.G_dot().transpose() * o.P_inv +
                                    grasp.G().transpose() * o.P_inv_dot - grasp.J_B_dot() * H_P_inv);
  terms.C_tilde = o.C_o + terms.G_J_T * (robot.M() * H_rate + robot.C() * H_P_inv);
  // N_tilde = N_o + G J^+T (F_bar' - M_bar' J^+ J_dot N sigma + M_bar' N sigma' + C_bar' N sigma)
  const VectorXd null_acceleration = N * sigma_prime - J_plus * (grasp.J_B_dot() * N_sigma);
  terms.N_tilde = o.N_o + terms.G_J_T * (robot.gravity() + robot.friction() + robot.M() * null_acceleration +
                                         robot.C() * N_sigma);
  return terms;
}

class PredictionTest : public ::testing::TestWithParam<Hands> {
 protected:
  /// Velocities and forces at random, and what the whole system answers with.
  const Prediction& Draw(std::mt19937* random) {
    scene_.DrawVelocities(random, 1.0);
    force_ = DrawForce(scene_.robot.size(), random);
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

// (52) holds for any torques, with sigma = xi and the null-space part of the acceleration as sigma'.
TEST_P(PredictionTest, ObjectSpaceDynamicsHoldInTheWholeSystem) {
  std::mt19937 random(4);
  const Prediction& p = Draw(&random);
  const Vector6d X_o_ddot = CalcCoordinateAcceleration(scene_.grasp, p.V_Bo_dot);
  Pseudoinverse pinv("J_B'", scene_.num_forces(), scene_.robot.size());
  pinv.Factor(scene_.grasp.J_B());
  const auto calc_residual = [&](const VectorXd& sigma, const VectorXd& sigma_prime) -> Vector6d {
    const ObjectSpaceTerms t = CalcObjectSpaceTerms(scene_.robot, scene_.grasp, pinv, sigma, sigma_prime);
    return t.M_tilde * X_o_ddot + t.C_tilde * scene_.X_o_dot + t.N_tilde - t.G_J_T * force_;
  };
  // Measured 5e-12.
  constexpr double kTolerance = 5e-11;
  EXPECT_TRUE(MatrixNear(calc_residual(scene_.xi, p.xi_dot), Vector6d::Zero(), kTolerance));
  // Wrong null-space motions do not satisfy it.
  EXPECT_GT(calc_residual(VectorXd::Zero(scene_.robot.size()), p.xi_dot).norm(), 1e3 * kTolerance);
  EXPECT_GT(calc_residual(scene_.xi, VectorXd::Zero(scene_.robot.size())).norm(), 1e3 * kTolerance);
}

// (47): pseudoinverse and projector give back the motion that satisfies the constraint.
TEST_P(PredictionTest, Equation47ReproducesTheMotion) {
  std::mt19937 random(5);
  const Prediction& p = Draw(&random);
  const Vector6d X_o_ddot = CalcCoordinateAcceleration(scene_.grasp, p.V_Bo_dot);
  const ObjectTerms& o = scene_.grasp.coordinates();
  const MatrixXd G_T = scene_.grasp.G().transpose();
  const MatrixXd G_T_dot = scene_.grasp.G_dot().transpose();
  Pseudoinverse pinv("J_B'", scene_.num_forces(), scene_.robot.size());
  pinv.FactorWeighted(scene_.grasp.J_B(), scene_.robot.M());
  const MatrixXd J_plus = pinv.CalcMatrix();
  const MatrixXd N = pinv.CalcProjector();
  const VectorXd xi = J_plus * G_T * o.P_inv * scene_.X_o_dot + N * scene_.xi;
  EXPECT_TRUE(MatrixNear(xi, scene_.xi, kForceRounding));
  const VectorXd xi_dot = J_plus * (G_T_dot * o.P_inv * scene_.X_o_dot + G_T * o.P_inv_dot * scene_.X_o_dot +
                                    G_T * o.P_inv * X_o_ddot - scene_.grasp.J_B_dot() * xi) +
                          N * p.xi_dot;
  EXPECT_TRUE(MatrixNear(xi_dot, p.xi_dot, kAccelerationRounding));
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

TEST(ConstrainedDynamics, TermsByPoseAreThoseByCoordinates) {
  GraspScene scene;
  std::mt19937 random(6);
  scene.DrawVelocities(&random, 1.0);
  GraspTerms by_pose(scene.model, scene.fingertips, scene.object, scene.surface);
  by_pose.SetPose(scene.robot, CalcObjectPose(scene.X_o), scene.grasp.V_Bo(), scene.kappa);
  EXPECT_TRUE(MatrixNear(by_pose.G(), scene.grasp.G(), 0.0));
  EXPECT_TRUE(MatrixNear(by_pose.G_dot(), scene.grasp.G_dot(), 0.0));
  EXPECT_TRUE(MatrixNear(by_pose.J_B_dot(), scene.grasp.J_B_dot(), 0.0));
  EXPECT_TRUE(MatrixNear(by_pose.body().N_o, scene.grasp.body().N_o, 0.0));
  EXPECT_TRUE(MatrixNear(by_pose.slip_bias(), scene.grasp.slip_bias(), 0.0));
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

TEST(ConstrainedDynamics, RejectsWrongSizes) {
  GraspScene scene;
  ConstrainedDynamics dynamics(scene.model, 3);
  const VectorXd force = VectorXd::Zero(scene.robot.size());
  EXPECT_TRUE(Throws<std::invalid_argument>([&] { return dynamics.Predict(scene.robot, scene.grasp, force); },
                                            "number of contact forces"));
  EXPECT_TRUE(Throws<std::invalid_argument>(
      [&] { return dynamics.Predict(scene.robot, scene.grasp, VectorXd::Zero(3)); }, "length of force"));
}

// E_bar' = diag(S_v^T E_v, 1), for both choices of v.
TEST(ActuationMap, IsEBar) {
  for (const DriveVelocity velocity : {DriveVelocity::kTwist, DriveVelocity::kWheelRates}) {
    const RobotModel model = ReadPaperRobot(velocity);
    const ActuationMap actuation(model);
    std::mt19937 random(7);
    const VectorXd tau = DrawForce(model.num_velocities(), &random);
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
