// (53) to (57): the law at single states, against the printed formula and the rigid prediction.

#include "controller/control/computed_torque.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "controller/common/errors.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/control/grasp_terms.h"
#include "controller/object/so3.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"
#include "tests/controller/control/printed_law.h"

namespace dexcheck::testing::computed_torque_test {
namespace {

// Measured, largest of all hands and weights: contact forces 2.8e-14 N (of 40 N), their wrench as M_o
// X_o_ddot + ... of a predicted X_o_ddot 2.3e-13 N (of 15 N; with Eigen's factorisation in the prediction
// 3.4e-13), accelerations 1.4e-11 (of 1000 rad/s^2); through the inverses that the printed form makes of
// ill-conditioned products 2.5e-11 N m (of 100).
constexpr double kForceRounding = 2e-13;
constexpr double kPredictedWrenchRounding = 1e-12;
constexpr double kAccelerationRounding = 1.4e-10;
constexpr double kPrintedRounding = 2.5e-10;

DesiredMotion DrawDesired(const GraspScene& scene, std::mt19937* random) {
  return {scene.X_o + DrawVector(6, 0.05, random), DrawVector(6, 0.5, random), DrawVector(6, 2.0, random)};
}

constexpr RedundancyWeight::Kind kWeights[] = {
    RedundancyWeight::Kind::kIdentity, RedundancyWeight::Kind::kDiagonal, RedundancyWeight::Kind::kMass};

RedundancyWeight MakeWeight(RedundancyWeight::Kind kind, Eigen::Index n) {
  RedundancyWeight weight{kind, {}};
  if (kind == RedundancyWeight::Kind::kDiagonal) weight.w = VectorXd::LinSpaced(n, 1.0, 3.0);
  return weight;
}

Pseudoinverse FactorJacobian(const GraspScene& scene, const RedundancyWeight& weight) {
  Pseudoinverse pinv("J_B'", scene.num_forces(), scene.robot.size());
  using enum RedundancyWeight::Kind;
  if (weight.kind == kIdentity) pinv.Factor(scene.grasp.J_B());
  if (weight.kind == kDiagonal) pinv.FactorDiagonal(scene.grasp.J_B(), weight.w);
  if (weight.kind == kMass) pinv.FactorWeighted(scene.grasp.J_B(), scene.robot.M());
  return pinv;
}

class LawTest : public ::testing::TestWithParam<std::tuple<Hands, RedundancyWeight::Kind>> {
 protected:
  LawTest()
      : scene_(std::get<0>(GetParam())),
        weight_(MakeWeight(std::get<1>(GetParam()), scene_.robot.size())),
        law_(scene_.model, scene_.grasp.num_contacts(), weight_),
        dynamics_(scene_.model, scene_.grasp.num_contacts()),
        actuation_(scene_.model) {}

  VectorXd CalcForce(const Vector6d& V_Bo_dot, const VectorXd& sigma_prime, const VectorXd& F_N) {
    law_.SetDemand(scene_.robot, scene_.grasp, V_Bo_dot, sigma_prime);
    VectorXd force(scene_.robot.size());
    actuation_.CalcForce(law_.CalcTorque(scene_.grasp, F_N), force);
    return force;
  }

  std::mt19937 random_{1};
  GraspScene scene_;
  RedundancyWeight weight_;
  ComputedTorque law_;
  ConstrainedDynamics dynamics_;
  ActuationMap actuation_;
};

TEST_P(LawTest, IsThePrintedLaw) {
  for (int trial = 0; trial < 5; ++trial) {
    scene_.DrawVelocities(&random_, 1.0);
    const DesiredMotion desired = DrawDesired(scene_, &random_);
    const VectorXd sigma_prime = DrawVector(scene_.robot.size(), 5.0, &random_);
    const VectorXd F_N = scene_.CalcInternalForce(3.0);
    const VectorXd force =
        CalcForce(CalcTrackingAcceleration(MakeGains(), scene_.grasp, desired), sigma_prime, F_N);
    const PrintedLaw printed(scene_, FactorJacobian(scene_, weight_), MakeGains(), desired, sigma_prime, F_N);
    ASSERT_GT(force.norm(), 10.0);
    EXPECT_TRUE(MatrixNear(force, printed.force, kPrintedRounding));
  }
}

// (56), (57): the whole system answers with X_o_ddot = X_d_ddot + K_v E_dot + K_p E, and with the forces
// (49).
TEST_P(LawTest, WholeSystemFollowsTheErrorDynamics) {
  for (int trial = 0; trial < 5; ++trial) {
    scene_.DrawVelocities(&random_, 1.0);
    const DesiredMotion desired = DrawDesired(scene_, &random_);
    const VectorXd sigma_prime = DrawVector(scene_.robot.size(), 5.0, &random_);
    const VectorXd F_N = scene_.CalcInternalForce(3.0);
    ASSERT_GT(F_N.norm(), 1.0);
    const ObjectGains gains = MakeGains();
    const VectorXd force =
        CalcForce(CalcTrackingAcceleration(gains, scene_.grasp, desired), sigma_prime, F_N);
    const Prediction& p = dynamics_.Predict(scene_.robot, scene_.grasp, force);

    const Vector6d X_o_ddot = CalcCoordinateAcceleration(scene_.grasp, p.V_Bo_dot);
    const Vector6d E = desired.X_d - scene_.X_o;
    const Vector6d E_dot = desired.X_d_dot - scene_.X_o_dot;
    const Vector6d E_ddot = desired.X_d_ddot - X_o_ddot;
    ASSERT_GT(E_ddot.norm(), 1.0);
    EXPECT_TRUE(MatrixNear(E_ddot, -gains.K_v.cwiseProduct(E_dot) - gains.K_p.cwiseProduct(E),
                           kAccelerationRounding));
    EXPECT_TRUE(MatrixNear(p.xi_dot, law_.xi_dot_d(), kAccelerationRounding));
    EXPECT_TRUE(MatrixNear(p.f_c, law_.f_c(), kForceRounding));

    // f_c = G^+ (M_o X_o_ddot + C_o X_o_dot + N_o) + F_N, and the wrench alone comes from G^+.
    const ObjectTerms& o = scene_.grasp.coordinates();
    const Vector6d F_o = o.M_o * X_o_ddot + o.C_o * scene_.X_o_dot + o.N_o;
    EXPECT_TRUE(MatrixNear(law_.F_o(), F_o, kPredictedWrenchRounding));
    EXPECT_TRUE(MatrixNear(scene_.grasp.G() * p.f_c, F_o, kForceRounding));
    const MatrixXd G_plus =
        scene_.grasp.G().transpose() * CalcInverse(scene_.grasp.G() * scene_.grasp.G().transpose());
    EXPECT_TRUE(MatrixNear(p.f_c, G_plus * F_o + F_N, kForceRounding));
  }
}

// A of (56) has full column rank, so that (57) follows.
TEST_P(LawTest, AHasFullColumnRank) {
  scene_.DrawVelocities(&random_, 1.0);
  const DesiredMotion desired = DrawDesired(scene_, &random_);
  const VectorXd zero = VectorXd::Zero(scene_.robot.size());
  const VectorXd F_N = VectorXd::Zero(scene_.num_forces());
  const PrintedLaw printed(scene_, FactorJacobian(scene_, weight_), MakeGains(), desired, zero, F_N);
  // Columns for translation and rotation differ in unit: compare their directions.
  const VectorXd sigma = CalcSingularValues(printed.A_transposed.rowwise().normalized());
  EXPECT_GT(sigma[5], 1e-4 * sigma[0]);  // measured 8e-4
}

TEST_P(LawTest, FaultyLawsDoNotFollowTheErrorDynamics) {
  scene_.DrawVelocities(&random_, 1.0);
  const DesiredMotion desired = DrawDesired(scene_, &random_);
  const VectorXd sigma_prime = VectorXd::Zero(scene_.robot.size());
  const VectorXd F_N = scene_.CalcInternalForce(3.0);
  const Pseudoinverse pinv = FactorJacobian(scene_, weight_);
  const Vector6d demanded = CalcTrackingAcceleration(MakeGains(), scene_.grasp, desired);
  const auto calc_error = [&](Fault fault) {
    const PrintedLaw law(scene_, pinv, MakeGains(), desired, sigma_prime, F_N, fault);
    const Vector6d V_Bo_dot = dynamics_.Predict(scene_.robot, scene_.grasp, law.force).V_Bo_dot;
    return (V_Bo_dot - demanded).cwiseAbs().maxCoeff();
  };
  EXPECT_LT(calc_error(Fault::kNone), kAccelerationRounding);
  EXPECT_GT(calc_error(Fault::kNoPlatformRate), 1e6 * kAccelerationRounding);
  EXPECT_GT(calc_error(Fault::kNoCoriolis), 1e6 * kAccelerationRounding);
  EXPECT_GT(calc_error(Fault::kNoContactRate), 1e6 * kAccelerationRounding);
  EXPECT_GT(calc_error(Fault::kTransposedGrasp), 1e6 * kAccelerationRounding);
}

// On SO(3), too, the rotation error obeys (57) exactly.
TEST_P(LawTest, RotationErrorFollowsTheErrorDynamics) {
  scene_.DrawVelocities(&random_, 1.0);
  DesiredMotion desired = DrawDesired(scene_, &random_);
  desired.X_d.tail<3>() += Vector3d(0.4, -0.3, 0.5);
  const ObjectGains gains = MakeGains();
  const Vector6d demanded =
      CalcTrackingAcceleration(gains, OrientationFeedback::kRotation, scene_.grasp, desired);
  const VectorXd zero = VectorXd::Zero(scene_.robot.size());
  const VectorXd force = CalcForce(demanded, zero, scene_.CalcInternalForce(3.0));
  const Vector6d V_dot = dynamics_.Predict(scene_.robot, scene_.grasp, force).V_Bo_dot;
  EXPECT_TRUE(MatrixNear(V_dot, demanded, kAccelerationRounding));

  // e_R along the motions that both accelerations mean, by differences.
  const DesiredPose d = CalcDesiredPose(desired);
  const Pose X_Bo = scene_.grasp.X_Bo();
  const Vector6d V = scene_.grasp.V_Bo();
  const auto rotate = [](const Matrix3d& R, const Vector3d& omega, const Vector3d& omega_dot, double t) {
    // Second order in t: R(t) = R exp(omega t + omega_dot t^2 / 2).
    return Matrix3d(R * ExpSo3(omega * t + omega_dot * (t * t / 2.0)));
  };
  const auto calc_e_R = [&](double t) {
    const Matrix3d R_o = rotate(X_Bo.linear(), V.tail<3>(), V_dot.tail<3>(), t);
    const Matrix3d R_d = rotate(d.R_Bd, d.omega_d, d.omega_d_dot, t);
    return LogSo3(R_o.transpose() * R_d);
  };
  constexpr double kStep = 1e-3;  // error of the differences: kStep^2 times rates of 1e3 1/s^4, eps / kStep^2
  const Vector3d e = calc_e_R(0.0);
  const Vector3d e_dot = (calc_e_R(kStep) - calc_e_R(-kStep)) / (2.0 * kStep);
  const Vector3d e_ddot = (calc_e_R(kStep) - 2.0 * e + calc_e_R(-kStep)) / (kStep * kStep);
  ASSERT_GT(e_ddot.norm(), 1.0);
  EXPECT_TRUE(MatrixNear(
      e_ddot, -gains.K_v.tail<3>().cwiseProduct(e_dot) - gains.K_p.tail<3>().cwiseProduct(e), 1e-3));
}

std::string NameCase(const ::testing::TestParamInfo<LawTest::ParamType>& info) {
  constexpr const char* kHands[] = {"RightHand", "LeftHand", "BothHands"};
  constexpr const char* kKinds[] = {"Identity", "Diagonal", "Mass"};
  return std::string(kHands[static_cast<int>(std::get<0>(info.param))]) +
         kKinds[static_cast<int>(std::get<1>(info.param))];
}

INSTANTIATE_TEST_SUITE_P(HandsAndWeights, LawTest,
                         ::testing::Combine(::testing::Values(Hands::kRight, Hands::kLeft, Hands::kBoth),
                                            ::testing::ValuesIn(kWeights)),
                         NameCase);

// The measured xi may violate (45), as in a soft plant: the law plans with the nearest velocity that does
// not.
TEST(ComputedTorque, PlansWithTheNearestVelocityThatDoesNotSlip) {
  GraspScene scene;
  std::mt19937 random(2);
  scene.DrawVelocities(&random, 1.0);
  const VectorXd consistent = scene.xi;
  scene.xi += DrawVector(scene.robot.size(), 0.1, &random);
  scene.SetState();
  ASSERT_GT(scene.grasp.slip().norm(), 1e-2);
  ComputedTorque law(scene.model, 4);
  law.SetDemand(scene.robot, scene.grasp, Vector6d::Zero(), VectorXd::Zero(scene.robot.size()));
  const VectorXd slip = scene.grasp.J_B() * law.xi_c() - scene.grasp.G().transpose() * scene.grasp.V_Bo();
  EXPECT_TRUE(MatrixNear(slip, VectorXd::Zero(scene.num_forces()), 1e-14));
  EXPECT_LE((law.xi_c() - scene.xi).norm(), (consistent - scene.xi).norm());
}

// With W = M_bar' the law does not depend on the coordinates of xi: both choices of v in (12) give one tau'.
TEST(ComputedTorque, BothChoicesOfVGiveTheSameTorques) {
  VectorXd tau[2];
  for (const DriveVelocity velocity : {DriveVelocity::kTwist, DriveVelocity::kWheelRates}) {
    GraspScene scene(Hands::kRight, velocity);
    scene.xi.head<2>() = CalcWheelRateMap(scene.model.base()).inverse() * Vector2d(6.0, -4.0);
    for (int i = 2; i < scene.robot.size(); ++i) scene.xi[i] = 0.5 * std::sin(i);
    scene.SetState();
    ComputedTorque law(scene.model, 4, {RedundancyWeight::Kind::kMass, {}});
    law.SetDemand(scene.robot, scene.grasp, Vector6d::Ones(), VectorXd::Zero(scene.robot.size()));
    tau[velocity == DriveVelocity::kTwist ? 0 : 1] =
        law.CalcTorque(scene.grasp, scene.CalcInternalForce(2.0));
  }
  ASSERT_GT(tau[0].head<2>().norm(), 0.1);
  EXPECT_TRUE(MatrixNear(tau[1], tau[0], kForceRounding));
}

// Hanging arm: the torus's axis is vertical, sin(beta) = 0. The law by pose works there.
TEST(ComputedTorque, WorksWhereTheAnglesAreSingular) {
  GraspScene scene;
  for (const char* joint : {"r_shoulder_pitch", "r_elbow"}) scene.q[3 + scene.model.FindJoint(joint)] = 0.0;
  scene.robot.SetState(scene.q, scene.xi);
  scene.robot.CalcDynamics();
  Pose X_po = Pose::Identity();
  X_po.translation() = Vector3d(0.0, 0.0, 0.12);
  const Pose X_Bo = scene.robot.CalcFramePose(scene.model.FindFrame("r_palm_frame")) * X_po;
  EXPECT_THROW(CalcObjectCoordinates(X_Bo, Vector6d::Zero()), SingularityError);
  scene.grasp.SetPose(scene.robot, X_Bo, Vector6d::Zero(), scene.kappa);

  DesiredPose desired;
  desired.p_Bd = X_Bo.translation() + Vector3d(0.01, -0.02, 0.03);
  desired.p_Bd_dot = Vector3d(0.1, 0.2, -0.1);
  desired.p_Bd_ddot = Vector3d(1.0, -1.0, 0.5);
  desired.R_Bd = X_Bo.linear() * ExpSo3(Vector3d(0.1, 0.2, -0.1));
  desired.omega_d = Vector3d(0.3, -0.2, 0.1);
  desired.omega_d_dot = Vector3d(-1.0, 0.5, 0.2);
  const Vector6d demanded = CalcTrackingAcceleration(MakeGains(), X_Bo, Vector6d::Zero(), desired);
  ASSERT_GT(demanded.norm(), 1.0);
  ComputedTorque law(scene.model, 4);
  law.SetDemand(scene.robot, scene.grasp, demanded, VectorXd::Zero(scene.robot.size()));
  VectorXd force(scene.robot.size());
  ActuationMap(scene.model).CalcForce(law.CalcTorque(scene.grasp, scene.CalcInternalForce(3.0)), force);
  ConstrainedDynamics dynamics(scene.model, 4);
  const Prediction& p = dynamics.Predict(scene.robot, scene.grasp, force);
  EXPECT_TRUE(MatrixNear(p.V_Bo_dot, demanded, kAccelerationRounding));
}

// tau_0 is what the torques would be without contact forces.
TEST(ComputedTorque, TorquesAreLinearInTheContactForces) {
  GraspScene scene;
  std::mt19937 random(3);
  scene.DrawVelocities(&random, 1.0);
  ComputedTorque law(scene.model, 4);
  law.SetDemand(scene.robot, scene.grasp, Vector6d::Zero(), VectorXd::Zero(scene.robot.size()));
  const VectorXd tau = law.CalcTorque(scene.grasp, scene.CalcInternalForce(2.0));
  VectorXd contact(tau.size());
  ActuationMap(scene.model).CalcTorque(scene.grasp.J_B().transpose() * law.f_c(), contact);
  ASSERT_GT(contact.norm(), 0.1);
  EXPECT_TRUE(MatrixNear(tau - law.tau_0(), contact, 1e-13));
}

// The tracking acceleration without angles is that with angles when there is no orientation error.
TEST(ObjectTracking, BothOrientationErrorsAgreeOnTheTrajectory) {
  GraspScene scene;
  std::mt19937 random(4);
  scene.DrawVelocities(&random, 1.0);
  DesiredMotion desired = DrawDesired(scene, &random);
  desired.X_d = scene.X_o;
  desired.X_d_dot = scene.X_o_dot;
  const ObjectGains gains = MakeGains();
  const Vector6d by_angles =
      CalcTrackingAcceleration(gains, OrientationFeedback::kAngles, scene.grasp, desired);
  const Vector6d by_rotation =
      CalcTrackingAcceleration(gains, OrientationFeedback::kRotation, scene.grasp, desired);
  ASSERT_GT(by_angles.norm(), 1.0);
  EXPECT_TRUE(MatrixNear(by_rotation, by_angles, 1e-13));
}

TEST(PostureTask, ByHand) {
  const RobotModel model = ReadPaperRobot();
  PostureTask task(model);
  VectorXd q = VectorXd::Zero(model.num_positions());
  VectorXd xi = VectorXd::Zero(model.num_velocities());
  VectorXd sigma_prime(xi.size());
  q[3 + 5] = 0.3;
  xi[2 + 5] = 0.5;
  xi[0] = 1.0;
  task.q_posture[5] = 0.1;
  task.stiffness[5] = 100.0;
  task.damping[2 + 5] = 20.0;
  task.damping[0] = 3.0;
  task.xi_reference[0] = 1.5;
  task.CalcAcceleration(q, xi, sigma_prime);
  VectorXd expected = VectorXd::Zero(xi.size());
  expected[2 + 5] = -100.0 * 0.2 - 20.0 * 0.5;
  expected[0] = 3.0 * 0.5;
  EXPECT_TRUE(MatrixNear(sigma_prime, expected, 1e-14));
  task.damping.resize(3);
  EXPECT_TRUE(
      Throws<std::invalid_argument>([&] { task.CalcAcceleration(q, xi, sigma_prime); }, "length of damping"));
}

TEST(ComputedTorque, RefusesAGraspWithoutFullRank) {
  GraspScene scene;
  // Two contacts leave the object free to turn about the line through them.
  const std::span<const int> two = std::span(scene.fingertips).subspan(1, 2);
  GraspTerms grasp(scene.model, two, scene.object, scene.surface);
  grasp.SetState(scene.robot, scene.X_o, scene.X_o_dot, std::span(scene.kappa).subspan(1, 2));
  ComputedTorque weak(scene.model, 2);
  EXPECT_TRUE(Throws<SingularityError>(
      [&] { weak.SetDemand(scene.robot, grasp, Vector6d::Zero(), VectorXd::Zero(scene.robot.size())); },
      "G has not full row rank, condition number"));
}

}  // namespace
}  // namespace dexcheck::testing::computed_torque_test
