// The law for any set of contacts: against (55), the rigid prediction and plain computed torque.

#include "controller/handling/handling_controller.h"

#include <gtest/gtest.h>

#include <random>

#include "controller/control/constrained_dynamics.h"
#include "tests/common/matrix_near.h"
#include "tests/controller/control/grasp_scene.h"

namespace dexcheck::testing::handling_controller_test {
namespace {

// Measured 3e-13 N m of 50, 2e-11 rad/s^2 of 100, 2e-13 N.
constexpr double kTorqueRounding = 1e-11;
constexpr double kAccelerationRounding = 1e-9;
constexpr double kForceRounding = 1e-11;

constexpr ContactSet kAll = AllContacts(4);

class HandlingControllerTest : public ::testing::Test {
 protected:
  HandlingControllerTest()
      : options_(MakeOptions(scene_.model)),
        grasp_(scene_.model, scene_.fingertips, scene_.object, scene_.surface, options_),
        handling_(scene_.model, scene_.fingertips, scene_.object, scene_.surface, options_) {
    demand_.touch_force.assign(4, 0.3);
    demand_.contacts = kAll;
    demand_.desired.X_d = scene_.X_o;
    demand_.f_min = options_.f_min;
  }

  static GraspControllerOptions MakeOptions(const RobotModel& model) {
    GraspControllerOptions options(model);
    options.orientation = OrientationFeedback::kRotation;
    options.gains.K_p.setConstant(400.0);
    options.gains.K_v.setConstant(40.0);
    options.posture.damping.setConstant(5.0);
    options.f_min = 1.0;
    options.f_max = 50.0;
    return options;
  }

  /// Sets q', xi and the object, whose velocity is consistent with rolling unless it rests.
  void SetState(bool object_rests) {
    std::mt19937 random(7);
    scene_.DrawVelocities(&random, 0.05);
    if (object_rests) {
      scene_.X_o_dot.setZero();
      scene_.ProjectVelocity();
    }
    state_.q = scene_.q;
    state_.xi = scene_.xi;
    state_.X_Bo = scene_.grasp.X_Bo();
    state_.V_Bo = scene_.grasp.V_Bo();
    state_.kappa = scene_.kappa;
    state_.overlap.assign(4, 0.0);
    grasp_.SetState(state_);
  }

  const VectorXd& CalcTorque() {
    return handling_.CalcTorque(grasp_.model(), state_, demand_, grasp_.sigma_prime());
  }

  VectorXd CalcForce(const VectorXd& tau) const {
    VectorXd force(tau.size());
    ActuationMap(scene_.model).CalcForce(tau, force);
    return force;
  }

  GraspScene scene_;
  GraspControllerOptions options_;
  GraspController grasp_;
  HandlingController handling_;
  HandlingDemand demand_;
  MeasuredState state_;
};

TEST_F(HandlingControllerTest, CarryingWithAllContactsIsTheLawOfThePaper) {
  SetState(/*object_rests=*/false);
  demand_.carried = true;
  demand_.grip = demand_.weight = 1.0;
  demand_.desired.X_d_ddot << 0.3, -0.2, 0.5, 0.0, 0.0, 0.0;
  const VectorXd tau = CalcTorque();
  const VectorXd expected = grasp_.CalcTorque(demand_.desired);
  ASSERT_GT(expected.norm(), 1.0);
  EXPECT_TRUE(MatrixNear(tau, expected, kTorqueRounding));
  EXPECT_TRUE(MatrixNear(handling_.f_c(), grasp_.law().f_c(), kForceRounding));
}

TEST_F(HandlingControllerTest, WithoutContactItIsComputedTorque) {
  SetState(/*object_rests=*/true);
  demand_.contacts = 0;
  const VectorXd tau = CalcTorque();
  ConstrainedDynamics dynamics(scene_.model, 4);
  const Prediction& free = dynamics.PredictFree(grasp_.robot(), CalcForce(tau));
  ASSERT_GT(grasp_.sigma_prime().norm(), 0.1);
  EXPECT_TRUE(MatrixNear(free.xi_dot, grasp_.sigma_prime(), kAccelerationRounding));
  EXPECT_EQ(handling_.f_c().norm(), 0.0);
}

TEST_F(HandlingControllerTest, FingertipsThatTouchPushAsTheyShould) {
  SetState(/*object_rests=*/true);
  for (const ContactSet set : {ContactSet{1}, ContactSet{2 + 8}, ContactSet{1 + 2 + 4}, kAll}) {
    SCOPED_TRACE(set);
    demand_.contacts = set;
    demand_.touch_force = {0.3, 0.25, 0.2, 0.15};
    const VectorXd tau = CalcTorque();
    // The rigid robot against an object that lies still.
    PartialGrasp part(scene_.model, scene_.fingertips, scene_.object, scene_.surface, set);
    part.SetState(grasp_.robot(), state_);
    ConstrainedDynamics dynamics(scene_.model, static_cast<int>(part.members().size()));
    const Prediction& rigid =
        dynamics.Predict(grasp_.robot(), part.terms(), CalcForce(tau), ObjectSupport::kAtRest);
    VectorXd f_c(12);
    part.Scatter(rigid.f_c, f_c);
    EXPECT_TRUE(MatrixNear(f_c, handling_.f_c(), kForceRounding));
    for (size_t i = 0; i < 4; ++i) {
      const Vector3d expected =
          Contains(set, i) ? Vector3d(0.0, 0.0, demand_.touch_force[i]) : Vector3d(0, 0, 0);
      EXPECT_TRUE(MatrixNear(f_c.segment<3>(3 * static_cast<Eigen::Index>(i)), expected, kForceRounding));
    }
  }
}

TEST_F(HandlingControllerTest, BearsThePartOfTheWeightThatIsDemanded) {
  SetState(/*object_rests=*/true);
  demand_.grip = 1.0;
  for (const double weight : {0.0, 0.4, 1.3}) {
    demand_.weight = weight;
    CalcTorque();
    const Vector6d borne = grasp_.grasp().G() * handling_.f_c();
    EXPECT_TRUE(MatrixNear(borne, Vector6d(weight * grasp_.grasp().body().N_o), 1e-9));
    for (Eigen::Index i = 0; i < 4; ++i) {
      const Vector3d f = handling_.f_c().segment<3>(3 * i);
      EXPECT_LE(f.head<2>().norm(), options_.mu * f.z());
    }
  }
}

TEST_F(HandlingControllerTest, AHeavierObjectTakesAsMuchMoreForce) {
  SetState(/*object_rests=*/false);
  demand_.carried = true;
  demand_.grip = 1.0;
  demand_.desired.X_d_ddot[2] = 2.0;
  demand_.scale = demand_.weight = 1.3;
  CalcTorque();
  const Vector6d heavy = grasp_.grasp().G() * handling_.f_c();
  demand_.scale = demand_.weight = 1.0;
  CalcTorque();
  const Vector6d stated = grasp_.grasp().G() * handling_.f_c();
  ASSERT_GT(stated.norm(), 2.0);
  EXPECT_TRUE(MatrixNear(heavy, Vector6d(1.3 * stated), 1e-9));
}

TEST_F(HandlingControllerTest, TorquesDoNotJumpWhereAFingertipStartsToPush) {
  SetState(/*object_rests=*/true);
  state_.xi.setZero();
  grasp_.SetState(state_);
  demand_.touch_force.assign(4, 0.0);
  demand_.contacts = 0;
  const VectorXd before = CalcTorque();
  demand_.contacts = kAll;
  const VectorXd after = CalcTorque();
  EXPECT_TRUE(MatrixNear(after, before, kTorqueRounding));
  // A negative control: with force they do.
  demand_.touch_force.assign(4, 1.0);
  EXPECT_GT((CalcTorque() - before).norm(), 0.1);
}

TEST_F(HandlingControllerTest, RefusesWhatCannotBe) {
  SetState(/*object_rests=*/true);
  demand_.contacts = 3;
  demand_.grip = 0.5;
  EXPECT_THROW(CalcTorque(), std::invalid_argument);
  demand_.contacts = kAll;
  demand_.weight = 1000.0;
  EXPECT_THROW(CalcTorque(), GraspForceError);
}

}  // namespace
}  // namespace dexcheck::testing::handling_controller_test
