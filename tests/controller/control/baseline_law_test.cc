// The laws that the paper's is compared with, at single states: against (55) where they are the same by
// algebra, against the rigid system's answer where their closed loop is known in closed form, and against
// laws with a fault.

#include "controller/control/baseline_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "controller/control/constrained_dynamics.h"
#include "controller/object/so3.h"
#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/control/grasp_scene.h"

namespace dexcheck::testing::baseline_law_test {
namespace {

// Measured: forces 6e-13 N m (of 500), accelerations 1.8e-11 (of 1000).
constexpr double kForceRounding = 5e-12;
constexpr double kAccelerationRounding = 2e-10;
// Least effect of a fault.
constexpr double kFault = 1e-4;

constexpr ControlLaw kBaselines[] = {ControlLaw::kPdGravity, ControlLaw::kFeedforwardPd,
                                     ControlLaw::kOperationalSpace, ControlLaw::kImpedance};

BaselineLaw::Options MakeOptions() {
  BaselineLaw::Options options;
  options.gains = MakeGains();
  options.stiffness.K << 3000.0, 2000.0, 4000.0, 20.0, 30.0, 40.0;
  options.stiffness.D << 300.0, 200.0, 400.0, 2.0, 3.0, 4.0;
  options.stiffness.damping_ratio = 0.7;
  return options;
}

class BaselineLawTest : public ::testing::Test {
 protected:
  BaselineLawTest() : dynamics_(scene_.model, scene_.grasp.num_contacts()), actuation_(scene_.model) {}

  /// E_bar' tau' of a law with an internal force.
  VectorXd CalcForce(BaselineLaw* law, const DesiredMotion& desired, const VectorXd& sigma_prime) {
    law->SetDemand(scene_.robot, scene_.grasp, desired, sigma_prime);
    ComputedTorque second(scene_.model, scene_.grasp.num_contacts());
    second.SetForces(scene_.grasp, law->F_o(), law->force(), law->xi_dot_d());
    return ToForce(second.CalcTorque(scene_.grasp, scene_.CalcInternalForce(3.0)));
  }
  VectorXd CalcForce(ControlLaw which, const DesiredMotion& desired, const VectorXd& sigma_prime) {
    BaselineLaw law(scene_.model, scene_.grasp.num_contacts(), which, MakeOptions());
    return CalcForce(&law, desired, sigma_prime);
  }
  /// That of (55).
  VectorXd CalcPaperForce(const DesiredMotion& desired, const VectorXd& sigma_prime,
                          RedundancyWeight::Kind weight) {
    ComputedTorque law(scene_.model, scene_.grasp.num_contacts(), {weight, {}});
    law.SetDemand(scene_.robot, scene_.grasp, CalcTrackingAcceleration(MakeGains(), scene_.grasp, desired),
                  sigma_prime);
    return ToForce(law.CalcTorque(scene_.grasp, scene_.CalcInternalForce(3.0)));
  }
  VectorXd ToForce(const VectorXd& tau) {
    VectorXd force(tau.size());
    actuation_.CalcForce(tau, force);
    return force;
  }
  /// Motion of the rigid system under E_bar' tau'.
  Prediction Answer(const VectorXd& force) { return dynamics_.Predict(scene_.robot, scene_.grasp, force); }

  DesiredMotion DrawDesired() {
    return {scene_.X_o + DrawVector(6, 0.05, &random_), DrawVector(6, 0.5, &random_),
            DrawVector(6, 2.0, &random_)};
  }
  /// The motion that the object has, with any acceleration.
  DesiredMotion DrawWithoutError() { return {scene_.X_o, scene_.X_o_dot, DrawVector(6, 2.0, &random_)}; }
  VectorXd DrawSigmaPrime() { return DrawVector(scene_.robot.size(), 5.0, &random_); }

  /// Lambda by its definition, with whole inverses. @param object, robot factors on either part.
  Matrix6d CalcLambda(double object = 1.0, double robot = 1.0) const {
    const MatrixXd& J = scene_.grasp.J_B();
    const MatrixXd& G = scene_.grasp.G();
    return object * scene_.grasp.body().M_hat +
           robot * G * CalcInverse(J * CalcInverse(scene_.robot.M()) * J.transpose()) * G.transpose();
  }

  std::mt19937 random_{7};
  GraspScene scene_;
  ConstrainedDynamics dynamics_;
  ActuationMap actuation_;
};

TEST_F(BaselineLawTest, OperationalSpaceIsThePapersLawWithTheInertiaAsWeight) {
  for (int trial = 0; trial < 5; ++trial) {
    scene_.DrawVelocities(&random_, 1.0);
    const DesiredMotion desired = DrawDesired();
    const VectorXd sigma_prime = DrawSigmaPrime();
    const VectorXd force = CalcForce(ControlLaw::kOperationalSpace, desired, sigma_prime);
    ASSERT_GT(force.norm(), 10.0);
    EXPECT_TRUE(MatrixNear(force, CalcPaperForce(desired, sigma_prime, RedundancyWeight::Kind::kMass),
                           kForceRounding));
    // With another weight the redundant motion is another one.
    EXPECT_FALSE(
        MatrixNear(force, CalcPaperForce(desired, sigma_prime, RedundancyWeight::Kind::kIdentity), kFault));
  }
}

TEST_F(BaselineLawTest, WithoutErrorFeedForwardAndImpedanceAreThePapersLaw) {
  scene_.DrawVelocities(&random_, 1.0);
  const DesiredMotion desired = DrawWithoutError();
  const VectorXd sigma_prime = DrawSigmaPrime();
  const VectorXd paper = CalcPaperForce(desired, sigma_prime, RedundancyWeight::Kind::kIdentity);
  EXPECT_TRUE(MatrixNear(CalcForce(ControlLaw::kFeedforwardPd, desired, sigma_prime), paper, kForceRounding));
  EXPECT_TRUE(MatrixNear(CalcForce(ControlLaw::kImpedance, desired, sigma_prime), paper, kForceRounding));
  // PD knows nothing of the motion.
  EXPECT_FALSE(MatrixNear(CalcForce(ControlLaw::kPdGravity, desired, sigma_prime), paper, kFault));
}

TEST_F(BaselineLawTest, AtRestWithoutErrorEveryLawHoldsTheWeight) {
  const DesiredMotion rest{scene_.X_o, Vector6d::Zero(), Vector6d::Zero()};
  const VectorXd none = VectorXd::Zero(scene_.robot.size());
  for (const ControlLaw law : kBaselines) {
    SCOPED_TRACE(NameOf(law));
    const VectorXd force = CalcForce(law, rest, none);
    const Prediction answer = Answer(force);
    EXPECT_TRUE(MatrixNear(answer.V_Bo_dot, Vector6d::Zero().eval(), kAccelerationRounding));
    EXPECT_TRUE(MatrixNear(answer.xi_dot, none, kAccelerationRounding));
    // Gravity of the robot, and what holds the object: G f_c = N_o.
    const VectorXd f_c = answer.f_c;
    EXPECT_TRUE(MatrixNear(Vector6d(scene_.grasp.G() * f_c), scene_.grasp.body().N_o, kForceRounding));
    EXPECT_TRUE(
        MatrixNear(force, scene_.robot.gravity() + scene_.grasp.J_B().transpose() * f_c, kForceRounding));
  }
}

// At rest, pushed away: Lambda V_dot = W.
TEST_F(BaselineLawTest, TheObjectRespondsWithItsStiffnessOverTheAugmentedInertia) {
  const Vector6d offset = DrawVector(6, 0.02, &random_);
  const DesiredMotion desired{scene_.X_o + offset, Vector6d::Zero(), Vector6d::Zero()};
  const VectorXd none = VectorXd::Zero(scene_.robot.size());
  const Vector6d K = MakeOptions().stiffness.K;
  // Forces along the world's axes; the angles' difference as a rotation in Sigma_o.
  Vector6d W;
  W << scene_.grasp.X_Bo().linear().transpose() * K.head<3>().cwiseProduct(offset.head<3>()),
      K.tail<3>().cwiseProduct((CalcPInverse(scene_.X_o) * offset).tail<3>());
  const Vector6d expected = CalcLambda().inverse() * W;
  ASSERT_GT(expected.norm(), 0.1);
  for (const ControlLaw law : {ControlLaw::kPdGravity, ControlLaw::kFeedforwardPd, ControlLaw::kImpedance}) {
    SCOPED_TRACE(NameOf(law));
    const Vector6d answer = Answer(CalcForce(law, desired, none)).V_Bo_dot;
    EXPECT_TRUE(MatrixNear(answer, expected, kAccelerationRounding));
    // Without the object's inertia, or with 1 % more of the robot's, it is not.
    EXPECT_FALSE(MatrixNear(answer, CalcLambda(0.0).inverse() * W, kFault));
    EXPECT_FALSE(MatrixNear(answer, CalcLambda(1.0, 1.01).inverse() * W, kFault));
  }
}

// At the right place with a wrong velocity, so small that Coriolis forces, its square, are below the
// tolerance.
TEST_F(BaselineLawTest, DampingIsTheWrenchOfTheVelocityError) {
  constexpr double kSmall = 1e-6;
  const Vector6d X_d_dot = DrawVector(6, kSmall, &random_);
  const DesiredMotion desired{scene_.X_o, X_d_dot, Vector6d::Zero()};
  const VectorXd none = VectorXd::Zero(scene_.robot.size());
  const Vector6d V_e = CalcPInverse(scene_.X_o) * X_d_dot;
  Vector6d W;
  const Matrix3d R = scene_.grasp.X_Bo().linear();
  W << R.transpose() * MakeOptions().stiffness.D.head<3>().cwiseProduct(R * V_e.head<3>()),
      MakeOptions().stiffness.D.tail<3>().cwiseProduct(V_e.tail<3>());
  for (const ControlLaw law : {ControlLaw::kPdGravity, ControlLaw::kFeedforwardPd}) {
    SCOPED_TRACE(NameOf(law));
    BaselineLaw baseline(scene_.model, 4, law, MakeOptions());
    baseline.SetDemand(scene_.robot, scene_.grasp, desired, none);
    EXPECT_TRUE(MatrixNear(baseline.V_Bo_dot() / kSmall, CalcLambda().inverse() * W / kSmall, 1e-6));
  }
}

// Lambda s^2 + D s + K has the damping ratio that was asked for in all six modes, though none of the three is
// diagonal.
TEST_F(BaselineLawTest, ImpedanceDampsEveryModeAlike) {
  scene_.DrawVelocities(&random_, 0.3);
  BaselineLaw law(scene_.model, 4, ControlLaw::kImpedance, MakeOptions());
  const VectorXd none = VectorXd::Zero(scene_.robot.size());
  const Matrix6d Lambda = CalcLambda();
  // Columns of D by unit velocities, of K by unit displacements; V_d_dot of a desired motion without
  // acceleration is P_inv_dot X_d_dot.
  const Matrix6d P = CalcP(scene_.X_o);
  Matrix6d D, K;
  for (int i = 0; i < 6; ++i) {
    const Vector6d unit = Vector6d::Unit(i);
    const Vector6d X_d_dot = scene_.X_o_dot + P * unit;
    law.SetDemand(scene_.robot, scene_.grasp, {scene_.X_o, X_d_dot, Vector6d::Zero()}, none);
    D.col(i) = Lambda * (law.V_Bo_dot() - scene_.grasp.coordinates().P_inv_dot * X_d_dot);
    law.SetDemand(scene_.robot, scene_.grasp, {scene_.X_o + P * unit, scene_.X_o_dot, Vector6d::Zero()},
                  none);
    K.col(i) = Lambda * (law.V_Bo_dot() - scene_.grasp.coordinates().P_inv_dot * scene_.X_o_dot);
  }
  ASSERT_GT(std::abs(D(0, 4)) + std::abs(D(1, 5)) + std::abs(D(0, 1)), 1e-3);
  using Matrix12d = Eigen::Matrix<double, 12, 12>;
  Matrix12d A = Matrix12d::Zero();
  A.topRightCorner<6, 6>().setIdentity();
  A.bottomLeftCorner<6, 6>() = -Lambda.inverse() * K;
  A.bottomRightCorner<6, 6>() = -Lambda.inverse() * D;
  for (const std::complex<double>& s : CalcEigenvalues(A)) {
    EXPECT_NEAR(-s.real() / std::abs(s), 0.7, 1e-7);  // measured 1e-10
  }
}

TEST_F(BaselineLawTest, DefaultStiffnessIsThatOfTheErrorDynamicsAxisByAxis) {
  const Matrix3d R = scene_.grasp.X_Bo().linear();
  const ObjectStiffness stiffness = CalcStiffness(MakeGains(), CalcLambda(), R);
  Matrix6d turned = Matrix6d::Identity();
  turned.topLeftCorner<3, 3>() = R;
  const Vector6d inertia = (turned * CalcLambda() * turned.transpose()).diagonal();
  EXPECT_TRUE(MatrixNear(stiffness.K, MakeGains().K_p.cwiseProduct(inertia), 1e-9));
  EXPECT_TRUE(MatrixNear(stiffness.D, MakeGains().K_v.cwiseProduct(inertia), 1e-9));
  ObjectGains gains;
  gains.K_p.setConstant(400.0);
  gains.K_v.setConstant(28.0);
  EXPECT_DOUBLE_EQ(CalcStiffness(gains, CalcLambda(), R).damping_ratio, 0.7);
}

// V_error changes by V_d_dot - V_dot: by differences along a motion of object and desired frame, for both
// errors.
TEST_F(BaselineLawTest, ErrorsChangeAsTheirRatesSay) {
  constexpr double kStep = 1e-5;
  const Vector6d X_o = scene_.X_o, X_o_dot = DrawVector(6, 0.5, &random_),
                 X_o_ddot = DrawVector(6, 2.0, &random_);
  const Vector6d X_d = X_o + DrawVector(6, 0.3, &random_), X_d_dot = DrawVector(6, 0.5, &random_);
  const Vector6d X_d_ddot = DrawVector(6, 2.0, &random_);
  for (const OrientationFeedback feedback : {OrientationFeedback::kAngles, OrientationFeedback::kRotation}) {
    const auto evaluate = [&](double t) {
      scene_.X_o = X_o + t * X_o_dot + 0.5 * t * t * X_o_ddot;
      scene_.X_o_dot = X_o_dot + t * X_o_ddot;
      scene_.SetState();
      return CalcObjectErrors(feedback, scene_.grasp,
                              {X_d + t * X_d_dot + 0.5 * t * t * X_d_ddot, X_d_dot + t * X_d_ddot, X_d_ddot});
    };
    const Vector6d rate = (evaluate(kStep).V_error - evaluate(-kStep).V_error) / (2.0 * kStep);
    const ObjectErrors errors = evaluate(0.0);
    const ObjectTerms& o = scene_.grasp.coordinates();
    const Vector6d V_dot = o.P_inv * X_o_ddot + o.P_inv_dot * X_o_dot;
    ASSERT_GT(rate.norm(), 1.0);
    EXPECT_TRUE(MatrixNear(rate, errors.V_d_dot - V_dot, 1e-7));  // differences: measured 2e-9
    if (feedback == OrientationFeedback::kAngles) continue;
    EXPECT_TRUE(MatrixNear(errors.e.tail<3>(),
                           LogSo3(scene_.grasp.X_Bo().linear().transpose() * CalcRotationZyz(X_d.tail<3>())),
                           1e-14));
  }
}

}  // namespace
}  // namespace dexcheck::testing::baseline_law_test
