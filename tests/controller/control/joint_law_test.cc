// Laws for the joints of an arm that holds nothing: against what (18) answers, and against a fault.

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "controller/control/constrained_dynamics.h"
#include "controller/control/joint_controller.h"
#include "controller/control/joint_motion.h"
#include "tests/common/allocation_counter.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paper_robot.h"

namespace dexcheck::testing::joint_law_test {
namespace {

// Measured: 4e-14 N m (of 100), 2e-12 rad/s^2 (of 100): the wrist has a condition of some hundreds.
constexpr double kTorqueRounding = 1e-12;
constexpr double kAccelerationRounding = 1e-10;

VectorXd DrawVector(double scale, std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(-scale, scale);
  VectorXd v(7);
  for (double& entry : v) entry = uniform(*random);
  return v;
}

class JointLawTest : public ::testing::Test {
 protected:
  JointLawTest() : model_(ReadPanda()), robot_(model_, Coordinates::kReduced), dynamics_(model_, 0) {
    std::mt19937 random(20);
    q_ = DrawVector(1.0, &random);
    xi_ = DrawVector(1.0, &random);
    desired_ = {q_ + DrawVector(0.1, &random), DrawVector(1.0, &random), DrawVector(3.0, &random)};
    gains_ = {VectorXd::LinSpaced(7, 100, 400),
              VectorXd::LinSpaced(7, 20, 40),
              VectorXd::LinSpaced(7, 50, 500),
              VectorXd::LinSpaced(7, 5, 50),
              {},
              {}};
    robot_.SetState(q_, xi_);
    robot_.CalcDynamics();
  }

  const VectorXd& CalcTorque(ControlLaw law, const DesiredJoints& desired) {
    law_.emplace(model_, law, gains_);
    return law_->CalcTorque(robot_, q_, xi_, desired);
  }

  RobotModel model_;
  ModelTerms robot_;
  ConstrainedDynamics dynamics_;
  VectorXd q_, xi_;
  DesiredJoints desired_;
  JointGains gains_;
  std::optional<JointLaw> law_;
};

TEST_F(JointLawTest, ComputedTorqueMakesTheErrorLinear) {
  const VectorXd tau = CalcTorque(ControlLaw::kComputedTorque, desired_);
  ASSERT_GT(tau.cwiseAbs().maxCoeff(), 1.0);
  const VectorXd demand = desired_.q_ddot + gains_.K_v.cwiseProduct(desired_.q_dot - xi_) +
                          gains_.K_p.cwiseProduct(desired_.q - q_);
  EXPECT_TRUE(MatrixNear(law_->xi_dot_d(), demand, kAccelerationRounding));
  EXPECT_TRUE(MatrixNear(dynamics_.PredictFree(robot_, tau).xi_dot, demand, kAccelerationRounding));
}

TEST_F(JointLawTest, SpringsAndDampersBearTheWeight) {
  const VectorXd expected =
      robot_.gravity() + gains_.K.cwiseProduct(desired_.q - q_) + gains_.D.cwiseProduct(desired_.q_dot - xi_);
  EXPECT_TRUE(MatrixNear(CalcTorque(ControlLaw::kPdGravity, desired_), expected, kTorqueRounding));
  // Without error the arm rests, whatever it weighs.
  xi_.setZero();
  robot_.SetState(q_, xi_);
  robot_.CalcDynamics();
  const DesiredJoints rest{q_, xi_, xi_};
  const VectorXd& tau = CalcTorque(ControlLaw::kPdGravity, rest);
  ASSERT_GT(tau.cwiseAbs().maxCoeff(), 1.0);
  EXPECT_LE(dynamics_.PredictFree(robot_, tau).xi_dot.cwiseAbs().maxCoeff(), kAccelerationRounding);
}

TEST_F(JointLawTest, FeedforwardFollowsWithoutError) {
  const DesiredJoints on_it{q_, xi_, desired_.q_ddot};
  const VectorXd exact = CalcTorque(ControlLaw::kFeedforwardPd, on_it);
  EXPECT_TRUE(
      MatrixNear(dynamics_.PredictFree(robot_, exact).xi_dot, desired_.q_ddot, kAccelerationRounding));
  // An error of the position adds the spring, and nothing else.
  DesiredJoints off = on_it;
  off.q[3] += 0.01;
  VectorXd expected = exact;
  expected[3] += 0.01 * gains_.K[3];
  EXPECT_TRUE(MatrixNear(CalcTorque(ControlLaw::kFeedforwardPd, off), expected, kTorqueRounding));
}

TEST_F(JointLawTest, FrictionIsCompensatedAlongTheDesiredRate) {
  for (const ControlLaw law :
       {ControlLaw::kComputedTorque, ControlLaw::kPdGravity, ControlLaw::kFeedforwardPd}) {
    gains_.coulomb = gains_.viscous = VectorXd();
    VectorXd expected = CalcTorque(law, desired_);
    gains_.coulomb = VectorXd::LinSpaced(7, 1, 4);
    gains_.viscous = VectorXd::LinSpaced(7, 2, 9);
    gains_.coulomb_velocity = 0.5;
    for (Eigen::Index i = 0; i < 7; ++i) {
      const double rate = desired_.q_dot[i];
      expected[i] += gains_.coulomb[i] * std::tanh(rate / 0.5) + gains_.viscous[i] * rate;
    }
    EXPECT_TRUE(MatrixNear(CalcTorque(law, desired_), expected, kTorqueRounding));
  }
}

TEST_F(JointLawTest, AllocatesNothing) {
  gains_.coulomb = gains_.viscous = gains_.D;
  JointLaw law(model_, ControlLaw::kFeedforwardPd, gains_);
  const AllocationCounter counter;
  law.CalcTorque(robot_, q_, xi_, desired_);
  EXPECT_EQ(counter.count(), 0);
}

// Seven joints: one more than a block of the trajectories that the motion is made of.
TEST(JointMotion, GoesThroughItsPoints) {
  std::mt19937 random(21);
  const VectorXd start = DrawVector(1.0, &random);
  const std::vector<JointWayPoint> points = {{1.0, DrawVector(1.0, &random)},
                                             {2.5, DrawVector(1.0, &random)}};
  const JointMotion motion(start, points, {});
  DesiredJoints at;
  motion.Evaluate(-1.0, &at);
  EXPECT_EQ(at.q, start);
  EXPECT_TRUE(at.q_dot.isZero(0.0));
  for (const JointWayPoint& point : points) {
    motion.Evaluate(point.time, &at);
    EXPECT_TRUE(MatrixNear(at.q, point.q, 1e-14));
  }
  motion.Evaluate(9.0, &at);
  EXPECT_TRUE(MatrixNear(at.q, points[1].q, 1e-14));
  EXPECT_TRUE(at.q_dot.isZero(0.0));
}

TEST(JointMotion, HasTheDerivativesOfItsPositions) {
  std::mt19937 random(22);
  const VectorXd start = DrawVector(1.0, &random);
  const JointMotion motion(start, {{2.0, DrawVector(1.0, &random)}},
                           {{6, 0.3, 0.7, 1.0}, {2, 0.1, 2.0, 0.0}});
  constexpr double kStep = 1e-4;
  // The error of a central difference is kStep^2 / 6 of a third derivative of some 200/s^3.
  constexpr double kDifference = 1e-6;
  DesiredJoints before, at, after;
  for (const double t : {0.3, 1.1, 1.9, 3.0}) {
    motion.Evaluate(t - kStep, &before);
    motion.Evaluate(t, &at);
    motion.Evaluate(t + kStep, &after);
    EXPECT_GT(at.q_ddot.cwiseAbs().maxCoeff(), 0.1);
    EXPECT_TRUE(MatrixNear(at.q_dot, (after.q - before.q) / (2.0 * kStep), kDifference));
    EXPECT_TRUE(MatrixNear(at.q_ddot, (after.q_dot - before.q_dot) / (2.0 * kStep), 20.0 * kDifference));
  }
}

}  // namespace
}  // namespace dexcheck::testing::joint_law_test
