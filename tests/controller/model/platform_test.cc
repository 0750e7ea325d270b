#include "controller/model/platform.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "tests/common/linear_algebra.h"
#include "tests/common/matrix_near.h"

namespace dexcheck::testing::platform_test {
namespace {

// Entries reach 1/r = 10 and the products below a hundred; a handful of operations each: 10 eps * 100.
constexpr double kRounding = 2e-13;
// Central difference with kStep: truncation (kStep phi_dot)^2 / 6 < 1e-10 of an entry, rounding eps / kStep.
constexpr double kStep = 1e-5;
constexpr double kDifference = 5e-10;
// A mutated model must miss by far more than any tolerance here.
constexpr double kVisible = 1e-2;

constexpr double kR = 0.1;
constexpr double kB = 0.4;

Base MakeBase(DriveVelocity velocity) {
  Base base;
  base.type = BaseType::kDifferentialDrive;
  base.velocity = velocity;
  base.wheel_radius = kR;
  base.wheel_distance = kB;
  return base;
}

struct State {
  Vector3d q_v;
  Vector2d v;
};

std::vector<State> MakeStates(DriveVelocity velocity) {
  std::mt19937 generator(2101);
  std::uniform_real_distribution<double> heading(-4.0, 4.0);
  std::uniform_real_distribution<double> rate(-1.5, 1.5);
  std::vector<State> states;
  for (int i = 0; i < 20; ++i) {
    State state{{heading(generator), heading(generator), heading(generator)},
                {rate(generator), rate(generator)}};
    if (velocity == DriveVelocity::kWheelRates) state.v /= kR;
    states.push_back(state);
  }
  return states;
}

// Largest velocity, m/s, of the two points where the wheels touch the floor, by rigid-body kinematics in
// space: the wheel centre moves with the platform, the wheel turns with it and spins about its axle.
double CalcContactPointSpeed(const Vector3d& q_v, const Vector3d& q_v_dot, const Vector2d& wheel_rates) {
  const Matrix3d R = Eigen::AngleAxisd(q_v[2], Vector3d::UnitZ()).toRotationMatrix();
  const Vector3d omega_platform(0.0, 0.0, q_v_dot[2]);
  double speed = 0.0;
  for (int wheel = 0; wheel < 2; ++wheel) {
    const Vector3d p_center = R * Vector3d(0.0, wheel == 0 ? -kB / 2 : kB / 2, 0.0);
    const Vector3d v_center = Vector3d(q_v_dot[0], q_v_dot[1], 0.0) + omega_platform.cross(p_center);
    const Vector3d omega_wheel = omega_platform + R * Vector3d(0.0, wheel_rates[wheel], 0.0);
    const Vector3d v_contact = v_center + omega_wheel.cross(Vector3d(0.0, 0.0, -kR));
    speed = std::max(speed, v_contact.norm());
  }
  return speed;
}

// d/dt S_v along q_v_dot = S_v v by a central difference.
Eigen::Matrix<double, 3, 2> CalcSDotByDifference(const Base& base, const State& state) {
  const Vector3d q_v_dot = CalcPlatformConstraint(base, state.q_v, state.v).S_v * state.v;
  const Vector3d before = state.q_v - kStep * q_v_dot;
  const Vector3d after = state.q_v + kStep * q_v_dot;
  return (CalcPlatformConstraint(base, after, state.v).S_v -
          CalcPlatformConstraint(base, before, state.v).S_v) /
         (2 * kStep);
}

class PlatformTest : public ::testing::TestWithParam<DriveVelocity> {
 protected:
  const Base base_ = MakeBase(GetParam());
  const std::vector<State> states_ = MakeStates(GetParam());
};

INSTANTIATE_TEST_SUITE_P(BothChoicesOfV, PlatformTest,
                         ::testing::Values(DriveVelocity::kTwist, DriveVelocity::kWheelRates),
                         [](const ::testing::TestParamInfo<DriveVelocity>& info) {
                           return std::string(info.param == DriveVelocity::kTwist ? "Twist" : "WheelRates");
                         });

TEST(PlatformByHand, FacingYWithTwist) {
  // phi = pi/2, v_c = 1 m/s along +y, w_c = 0.5 rad/s. Wheel centres at 1 +- 0.5 * 0.2 = 1.1 and 0.9 m/s.
  const Base base = MakeBase(DriveVelocity::kTwist);
  const Vector2d v(1.0, 0.5);
  const PlatformConstraint platform = CalcPlatformConstraint(base, {3.0, -2.0, kPi / 2}, v);
  EXPECT_TRUE(MatrixNear(platform.A_v, Eigen::RowVector3d(-1.0, 0.0, 0.0), kRounding));
  EXPECT_TRUE(MatrixNear(platform.S_v * v, Vector3d(0.0, 1.0, 0.5), kRounding));
  // A turning forward speed of 1 m/s: centripetal acceleration v_c w_c towards -x.
  EXPECT_TRUE(MatrixNear(platform.S_v_dot * v, Vector3d(-0.5, 0.0, 0.0), kRounding));
  EXPECT_TRUE(MatrixNear(CalcWheelRateMap(base) * v, Vector2d(11.0, 9.0), kRounding));
  // 3 and 1 N m at r = 0.1 m push with 30 and 10 N: 40 N along +y and (30 - 10) 0.2 = 4 N m about z.
  const Vector2d tau(3.0, 1.0);
  EXPECT_TRUE(MatrixNear(platform.E_v * tau, Vector3d(0.0, 40.0, 4.0), kRounding));
  EXPECT_TRUE(MatrixNear(platform.S_v_T_E_v * tau, Vector2d(40.0, 4.0), kRounding));
}

TEST_P(PlatformTest, SSpansTheNullSpaceOfA) {
  for (const State& state : states_) {
    const PlatformConstraint platform = CalcPlatformConstraint(base_, state.q_v, state.v);
    ASSERT_EQ(CalcRank(platform.S_v), 2);
    EXPECT_NEAR(platform.A_v.norm(), 1.0, kRounding * TolScale());
    EXPECT_TRUE(MatrixNear(platform.S_v.transpose() * platform.A_v.transpose(), Vector2d::Zero(), kRounding));
  }
}

TEST_P(PlatformTest, WheelsRollWithoutSlipInSpace) {
  for (const State& state : states_) {
    const PlatformConstraint platform = CalcPlatformConstraint(base_, state.q_v, state.v);
    const Vector3d q_v_dot = platform.S_v * state.v;
    ASSERT_GT(q_v_dot.norm(), kVisible);
    EXPECT_LE(CalcContactPointSpeed(state.q_v, q_v_dot, CalcWheelRateMap(base_) * state.v),
              kRounding * TolScale());
  }
}

TEST_P(PlatformTest, SDotIsTheDerivativeOfS) {
  for (const State& state : states_) {
    const PlatformConstraint platform = CalcPlatformConstraint(base_, state.q_v, state.v);
    ASSERT_GT(platform.S_v_dot.norm(), 1e-4);
    EXPECT_TRUE(MatrixNear(platform.S_v_dot, CalcSDotByDifference(base_, state), kDifference));
  }
}

TEST_P(PlatformTest, VirtualPowerBalances) {
  const Vector2d tau(3.0, -1.7);
  for (const State& state : states_) {
    const PlatformConstraint platform = CalcPlatformConstraint(base_, state.q_v, state.v);
    const Vector2d wheel_rates = CalcWheelRateMap(base_) * state.v;
    const double power = tau.dot(wheel_rates);
    ASSERT_GT(std::abs(power), kVisible);
    EXPECT_NEAR((platform.E_v * tau).dot(platform.S_v * state.v), power, kRounding * TolScale());
    EXPECT_NEAR((platform.S_v_T_E_v * tau).dot(state.v), power, kRounding * TolScale());
  }
}

}  // namespace
}  // namespace dexcheck::testing::platform_test
