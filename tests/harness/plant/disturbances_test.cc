// Wrenches against what their keys mean, and the forces on xi that they become.

#include "harness/plant/disturbances.h"

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "tests/common/paper_robot.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::disturbances_test {
namespace {

constexpr double kDt = 1e-3;
using Kind = DisturbanceOptions::Kind;

class DisturbancesTest : public ::testing::Test {
 protected:
  DisturbancesTest() : model_(ReadPaperRobot()) {}
  [[nodiscard]] Disturbances Make(DisturbanceOptions one, std::uint64_t seed = 1) const {
    if (one.body.empty()) one.body = "object";
    one.key = "disturbance.0";
    return {std::vector<DisturbanceOptions>{one}, PartContext{&model_, 4, kDt, seed, "s.toml"}};
  }
  RobotModel model_;
};

TEST_F(DisturbancesTest, APulseLastsItsDurationAndComesAgain) {
  const Disturbances pulse = Make({.kind = Kind::kPulse, .begin = 1.0, .duration = 0.05, .period = 0.5});
  int steps = 0;
  for (int k = 0; k < 2000; ++k) steps += pulse.CalcSize(0, k * kDt) != 0.0 ? 1 : 0;
  EXPECT_EQ(steps, 2 * 50);
  EXPECT_EQ(pulse.CalcSize(0, 0.999), 0.0);
  EXPECT_EQ(pulse.CalcSize(0, 1.0), 1.0);
  EXPECT_EQ(pulse.CalcSize(0, 1.049), 1.0);
  EXPECT_EQ(pulse.CalcSize(0, 1.05), 0.0);
  EXPECT_EQ(pulse.CalcSize(0, -0.5), 0.0);
}

TEST_F(DisturbancesTest, StepAndSine) {
  const Disturbances step = Make({.kind = Kind::kStep, .begin = 0.2});
  EXPECT_EQ(step.CalcSize(0, 0.19), 0.0);
  EXPECT_EQ(step.CalcSize(0, 100.0), 1.0);
  const Disturbances sine = Make({.kind = Kind::kSine, .begin = 0.1, .frequency = 2.0});
  EXPECT_NEAR(sine.CalcSize(0, 0.1 + 0.125), 1.0, 1e-6);
  EXPECT_NEAR(sine.CalcSize(0, 0.1 + 0.375), -1.0, 1e-6);
}

TEST_F(DisturbancesTest, NoiseHasUnitVarianceAndNothingAboveItsBand) {
  constexpr double kBand = 10.0;
  const Disturbances noise = Make({.kind = Kind::kNoise, .frequency = kBand});
  constexpr int kSteps = 100000;
  double squares = 0.0, slope = 0.0, last = noise.CalcSize(0, 0.0);
  for (int k = 1; k <= kSteps; ++k) {
    const double x = noise.CalcSize(0, k * kDt);
    squares += x * x;
    slope = std::max(slope, std::abs(x - last) / kDt);
    last = x;
  }
  EXPECT_NEAR(squares / kSteps, 1.0, 0.02);
  // A sum of n sines of amplitude sqrt(2 / n) and frequencies i / n of the band: slopes add up at most.
  EXPECT_LT(slope, 2.0 * kPi * kBand * std::sqrt(2.0 * 32.0) * 0.5 * (1.0 + 1.0 / 32.0));
  EXPECT_GT(slope, 2.0 * kPi * kBand * 0.5);
}

TEST_F(DisturbancesTest, MomentAndSizeAreDrawnOncePerRepetitionFromTheSeed) {
  const DisturbanceOptions options{.kind = Kind::kPulse,
                                   .begin = 1.0,
                                   .duration = 0.1,
                                   .period = 2.0,
                                   .begin_within = 1.5,
                                   .size_within = 0.5};
  const Disturbances a = Make(options, 1), b = Make(options, 2);
  std::vector<double> begins, sizes;
  bool differs = false;
  for (int repetition = 0; repetition < 20; ++repetition) {
    double begin = -1.0, size = 0.0;
    int steps = 0;
    for (int k = 0; k < 2000; ++k) {
      const double t = 1.0 + 2.0 * repetition + k * kDt;
      const double x = a.CalcSize(0, t);
      differs = differs || x != b.CalcSize(0, t);
      if (x == 0.0) continue;
      if (begin < 0.0) begin = k * kDt;
      if (steps++ > 0) EXPECT_EQ(x, size);
      size = x;
    }
    EXPECT_NEAR(steps, 100, 1);
    EXPECT_GE(begin, 0.0);
    EXPECT_LE(begin, 1.5 + kDt);
    EXPECT_GE(size, 0.5);
    EXPECT_LE(size, 1.5);
    begins.push_back(begin);
    sizes.push_back(size);
  }
  EXPECT_TRUE(differs);
  std::ranges::sort(begins);
  EXPECT_GT(begins.back() - begins.front(), 0.7);
  EXPECT_NE(sizes[0], sizes[1]);
}

TEST_F(DisturbancesTest, WrenchesStandWhereAndAsTheirFrameSays) {
  MeasuredState state;
  state.q = VectorXd::Constant(model_.num_positions(), 0.2);
  state.xi = VectorXd::Zero(model_.num_velocities());
  state.X_Bo.translation() = Vector3d(1, 2, 3);
  state.X_Bo.linear() = Eigen::AngleAxisd(0.5 * kPi, Vector3d::UnitZ()).toRotationMatrix();
  const DisturbanceOptions options{.kind = Kind::kStep,
                                   .force = Vector3d(5, 0, 0),
                                   .torque = Vector3d(0, 0.1, 0),
                                   .at = Vector3d(0.1, 0, 0),
                                   .in_body_frame = true};
  Disturbances disturbances = Make(options);
  const Wrench w = disturbances.Evaluate(0.0, state)[0];
  EXPECT_LT((w.point - Vector3d(1, 2.1, 3)).norm(), 1e-15);
  EXPECT_LT((w.force - Vector3d(0, 5, 0)).norm(), 1e-15);
  EXPECT_LT((w.torque - Vector3d(-0.1, 0, 0)).norm(), 1e-15);
  Vector6d expected;
  expected << 5, 0, 0, 0, 0.1, 0;
  EXPECT_LT((CalcObjectWrench(disturbances.Evaluate(0.0, state), state.X_Bo) - expected).norm(), 1e-14);
}

/// Power of the wrench = power of the forces that it becomes, for any velocity.
TEST_F(DisturbancesTest, ForcesOnXiDoTheWrenchsWork) {
  for (const DriveVelocity velocity : {DriveVelocity::kTwist, DriveVelocity::kWheelRates}) {
    const RobotModel model = ReadPaperRobot(velocity);
    const VectorXd q = VectorXd::LinSpaced(model.num_positions(), -0.4, 0.7);
    const VectorXd xi = VectorXd::LinSpaced(model.num_velocities(), 1.1, -0.6);
    ModelTerms robot(model);
    robot.SetState(q, xi);
    for (const char* name : {"rf2_phalanx_3", "r_forearm"}) {
      const int link = model.FindLink(name);
      const Pose X = robot.CalcLinkPose(link);
      Wrench w;
      w.body = link;
      w.point = X * Vector3d(0.1, -0.2, 0.3);
      w.force = Vector3d(3, -2, 1);
      w.torque = Vector3d(0.3, 0.1, -0.5);
      VectorXd force = VectorXd::Zero(model.num_velocities());
      AddRobotForce(std::span(&w, 1), robot, force);
      const Vector6d V = robot.CalcLinkVelocity(link);
      const Vector3d at_point = V.head<3>() + V.tail<3>().cross(w.point - X.translation());
      const double power = w.force.dot(at_point) + w.torque.dot(V.tail<3>());
      EXPECT_GT(std::abs(power), 0.1);
      EXPECT_NEAR(force.dot(xi), power, 1e-12 * std::abs(power) * 100.0) << name;
    }
  }
}

TEST_F(DisturbancesTest, AnUnknownBodyIsRefused) {
  EXPECT_TRUE(Throws<InputError>([&] { return Make({.body = "r_forarm"}); },
                                 "s.toml: disturbance.0.body: is no link of the robot and not the object "
                                 R"(("r_forearm"?), got "r_forarm")"));
}

}  // namespace
}  // namespace dexcheck::testing::disturbances_test
