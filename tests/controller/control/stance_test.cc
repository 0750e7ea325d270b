// A robot that stands on the ground: contact rows against finite differences, the constrained system by its
// own equations, what the law asks of the ground, and the motion of its legs.

#include "controller/control/stance.h"

#include <gtest/gtest.h>

#include <random>

#include "controller/control/constrained_dynamics.h"
#include "controller/control/trajectory_controller.h"
#include "controller/model/parameter_reader.h"
#include "tests/common/finite_difference.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::stance_test {
namespace {

constexpr double kFiniteDifference = 1e-9;  // measured 2e-11 of rates of order 1, at h = 1e-3
constexpr double kForceRounding = 1e-11;    // of 100 N
constexpr double kHeight = 0.05;

VectorXd Draw(Eigen::Index size, double scale, std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(-scale, scale);
  VectorXd v(size);
  for (double& entry : v) entry = uniform(*random);
  return v;
}

class StanceTest : public ::testing::Test {
 protected:
  static Stance MakeStance(const RobotModel& model) {
    Stance stance;
    for (const char* foot : {"fl_foot", "fr_foot", "rl_foot", "rr_foot"})
      stance.feet.push_back(model.FindFrame(foot));
    stance.height = kHeight;
    stance.mu = 0.5;
    stance.f_min = 2.0;
    stance.f_max = 150.0;
    return stance;
  }
  static VectorXd MakePosture(const RobotModel& model, const Stance& stance) {
    VectorXd q = VectorXd::Zero(model.num_positions());
    q[2] = 0.35;
    q[3] = 1.0;
    for (int leg = 0; leg < 4; ++leg) q.segment<3>(7 + 3 * leg) << 0.05 * (leg % 2 == 0 ? 1 : -1), 0.8, -1.5;
    EXPECT_LT(PutFeetDown(model, stance, &q), 1e-12);
    return q;
  }
  /// q' after a small time at these rates.
  [[nodiscard]] VectorXd Move(const VectorXd& q, const VectorXd& xi, double t) const {
    VectorXd moved = q;
    moved.head<3>() += t * xi.head<3>();
    const Vector3d turn = t * xi.segment<3>(3);
    const Eigen::Quaterniond before(q[3], q[4], q[5], q[6]);
    const double angle = turn.norm();
    const Eigen::Quaterniond after =
        angle > 0.0 ? before * Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) : before;
    moved.segment<4>(3) << after.w(), after.x(), after.y(), after.z();
    moved.tail(q.size() - 7) += t * xi.tail(q.size() - 7);
    return moved;
  }

  RobotModel model_{ReadRobotModel(SourcePath("/controller/parameters/quadruped.toml"))};
  Stance stance_ = MakeStance(model_);
  VectorXd q_ = MakePosture(model_, stance_);
  std::mt19937 random_{11};
};

TEST_F(StanceTest, ContactRowsAreRatesOfTheContact) {
  const VectorXd xi = Draw(18, 1.0, &random_);
  const VectorXd q = Move(q_, Draw(18, 0.4, &random_), 1.0);
  ModelTerms robot(model_);
  GroundContacts ground(model_, stance_.feet, kHeight);
  const auto at = [&](double t) -> const GroundContacts& {
    robot.SetState(Move(q, xi, t), xi);
    ground.SetState(robot);
    return ground;
  };
  const VectorXd J_dot_xi = at(0.0).J_dot_xi();
  const VectorXd rate = ground.J() * xi;
  const VectorXd gap_rate = Differentiate([&](double t) { return VectorXd(at(t).gap()); }, 1e-3);
  // J xi of constant xi
  const VectorXd expected = Differentiate([&](double t) { return VectorXd(at(t).J() * xi); }, 1e-3);
  ASSERT_GT(J_dot_xi.norm(), 0.1);
  EXPECT_TRUE(MatrixNear(J_dot_xi, expected, kFiniteDifference));
  for (Eigen::Index i = 0; i < 4; ++i) EXPECT_NEAR(rate[3 * i + 2], gap_rate[i], kFiniteDifference);
}

TEST_F(StanceTest, TheConstrainedSystemFulfilsItsEquations) {
  ModelTerms robot(model_);
  robot.SetState(q_, Draw(18, 0.5, &random_));
  robot.CalcDynamics();
  GroundContacts ground(model_, stance_.feet, kHeight);
  ground.SetState(robot);
  VectorXd force = Draw(18, 5.0, &random_);
  force.head<6>().setZero();
  GroundDynamics dynamics(model_, 4);
  const Prediction& p = dynamics.Predict(robot, ground, force);
  EXPECT_TRUE(dynamics.determines_forces());
  const VectorXd left = robot.M() * p.xi_dot + robot.C() * robot.velocity() + robot.gravity() +
                        robot.friction() - force - ground.J().transpose() * p.f_c;
  ASSERT_GT(p.f_c.norm(), 50.0);
  EXPECT_TRUE(MatrixNear(left, VectorXd::Zero(18), kForceRounding));
  EXPECT_TRUE(MatrixNear(ground.J() * p.xi_dot, -ground.J_dot_xi(), 1e-11));
}

// Each foot twice, as two frames of one place: what moves is the same, and forces are shared.
TEST_F(StanceTest, MoreFeetThanHoldTheRobotDetermineItsMotion) {
  std::vector<int> twice = stance_.feet;
  twice.insert(twice.end(), stance_.feet.begin(), stance_.feet.end());
  ModelTerms robot(model_);
  robot.SetState(q_, Draw(18, 0.5, &random_));
  robot.CalcDynamics();
  GroundContacts four(model_, stance_.feet, kHeight), eight(model_, twice, kHeight);
  four.SetState(robot);
  eight.SetState(robot);
  GroundDynamics of_four(model_, 4), of_eight(model_, 8);
  const VectorXd force = VectorXd::Zero(18);
  const VectorXd xi_dot = of_four.Predict(robot, four, force).xi_dot;
  const VectorXd f = of_four.Predict(robot, four, force).f_c;
  const Prediction& p = of_eight.Predict(robot, eight, force);
  EXPECT_FALSE(of_eight.determines_forces());
  EXPECT_TRUE(MatrixNear(p.xi_dot, xi_dot, 1e-9));
  EXPECT_TRUE(MatrixNear(p.f_c.head(12), 0.5 * f, 1e-8));
}

TEST_F(StanceTest, TheGroundGivesWhatNoMotorCan) {
  ModelTerms robot(model_);
  robot.SetState(q_, VectorXd::Zero(18));
  robot.CalcDynamics();
  StanceForces forces(model_, stance_);
  VectorXd F = robot.gravity();
  F.head<6>() += Draw(6, 3.0, &random_);
  VectorXd tau = F;
  forces.TakeOff(robot, tau);
  EXPECT_TRUE(MatrixNear(tau.head<6>(), Vector6d::Zero(), kForceRounding));
  EXPECT_GT(tau.tail<12>().norm(), 1.0);
  for (Eigen::Index i = 0; i < 4; ++i) {
    EXPECT_LE(forces.f().segment<2>(3 * i).norm(), stance_.mu * forces.f()[3 * i + 2]);
    EXPECT_GE(forces.f()[3 * i + 2], stance_.f_min);
  }
  // Under these torques the rigid system stands still, but for what was asked for besides.
  GroundContacts ground(model_, stance_.feet, kHeight);
  ground.SetState(robot);
  tau = robot.gravity();
  forces.TakeOff(robot, tau);
  tau.head<6>().setZero();
  GroundDynamics dynamics(model_, 4);
  const Prediction& p = dynamics.Predict(robot, ground, tau);
  EXPECT_TRUE(MatrixNear(p.xi_dot, VectorXd::Zero(18), 1e-9));
  EXPECT_TRUE(MatrixNear(p.f_c, forces.f(), 1e-9));
  // Nothing on the ground can pull.
  F = -robot.gravity();
  EXPECT_THROW(forces.TakeOff(robot, F), GraspForceError);
}

TEST_F(StanceTest, LegsFollowTheBodyWithoutSlip) {
  std::vector<JointWayPoint> points = {{1.0, VectorXd::Zero(6)}};
  points[0].q << 0.03, 0.02, -0.03, 0.1, -0.1, 0.15;
  const StanceMotion motion(model_, stance_, q_, JointMotion(VectorXd::Zero(6), points, {}));
  ModelTerms robot(model_);
  GroundContacts ground(model_, stance_.feet, kHeight);
  DesiredJoints at;
  const auto positions = [&](double t) {
    motion.Evaluate(0.5 + t, &at);
    return at.q;
  };
  const VectorXd q_rate = Differentiate([&](double t) { return VectorXd(positions(t).tail(12)); }, 1e-3);
  const VectorXd base_rate = Differentiate([&](double t) { return VectorXd(positions(t).head(3)); }, 1e-3);
  const VectorXd acceleration = Differentiate(
      [&](double t) {
        motion.Evaluate(0.5 + t, &at);
        return at.q_dot;
      },
      1e-3);
  motion.Evaluate(0.5, &at);
  ASSERT_GT(at.q_dot.norm(), 0.1);
  robot.SetState(at.q, at.q_dot);
  ground.SetState(robot);
  EXPECT_TRUE(MatrixNear(ground.gap(), VectorXd::Zero(4), 1e-12));
  EXPECT_TRUE(MatrixNear(ground.J() * at.q_dot, VectorXd::Zero(12), 1e-12));
  EXPECT_TRUE(MatrixNear(ground.J() * at.q_ddot, -ground.J_dot_xi(), 1e-11));
  EXPECT_TRUE(MatrixNear(at.q_dot.head(3), base_rate, 1e-8));
  // How far spheres have rolled is exact to second order in their turn, 0.2 rad: rates of some rad/s to 1 %.
  EXPECT_TRUE(MatrixNear(at.q_dot.tail(12), q_rate, 0.01));
  EXPECT_TRUE(MatrixNear(at.q_ddot, acceleration, 0.03));
  // By its own coordinates the base turns as it says.
  VectorXd error(18);
  const VectorXd before = positions(-1e-5), after = positions(1e-5);
  CalcPositionError(true, after, before, error);
  motion.Evaluate(0.5, &at);
  EXPECT_TRUE(MatrixNear(error.segment<3>(3) / 2e-5, at.q_dot.segment<3>(3), 1e-6));
}

}  // namespace
}  // namespace dexcheck::testing::stance_test
