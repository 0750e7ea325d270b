// Measurements against the meaning of the keys of sensing: variances, transfer functions, delays.

#include "harness/plant/sensing.h"

#include <gtest/gtest.h>

#include <complex>

#include "controller/common/errors.h"
#include "controller/object/so3.h"
#include "tests/common/paper_robot.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::sensing_test {
namespace {

constexpr double kDt = 1e-3;

/// One robot's sensing of the same true state again and again, or of a moving one.
class SensingTest : public ::testing::Test {
 protected:
  SensingTest() : model_(ReadPaperRobot()) {
    truth_.state.q = VectorXd::Constant(model_.num_positions(), 0.1);
    truth_.state.xi = VectorXd::Constant(model_.num_velocities(), 0.2);
    truth_.state.kappa.resize(4);
    truth_.state.overlap.resize(4);
    truth_.state.X_Bo.translation() = Vector3d(0.5, 0.2, 1.0);
  }
  [[nodiscard]] Sensing Make(const SensingOptions& options, std::uint64_t seed = 1) const {
    return {options, PartContext{&model_, 4, kDt, seed, "s.toml"}};
  }
  const Reading& Measure(Sensing& sensing) {
    sensing.Measure(truth_, &measured_);
    return measured_;
  }
  double& Joint(int i) { return truth_.state.q[model_.num_base_positions() + i]; }
  [[nodiscard]] double MeasuredJoint(int i) const {
    return measured_.state.q[model_.num_base_positions() + i];
  }
  [[nodiscard]] double MeasuredRate(int i) const {
    return measured_.state.xi[model_.num_base_velocities() + i];
  }

  RobotModel model_;
  PlantReading truth_;
  Reading measured_;
};

TEST_F(SensingTest, QuantisationHasTheVarianceOfAnEvenError) {
  const double step = 2.0 * kPi / 4096.0;
  Sensing sensing = Make({.joint_counts = {.all = 4096.0}});
  double sum = 0.0, squares = 0.0;
  constexpr int kSteps = 4000;
  for (int k = 0; k < kSteps; ++k) {
    // Slow enough that all parts of a count are visited, with no relation to it.
    Joint(3) = 1.234e-4 * k;
    Measure(sensing);
    const double error = MeasuredJoint(3) - Joint(3);
    EXPECT_LE(std::abs(error), 0.5 * step * (1.0 + 1e-9));
    sum += error;
    squares += error * error;
    EXPECT_NEAR(std::remainder(MeasuredJoint(3), step), 0.0, 1e-12);
  }
  // Even over one count: mean 0, variance q^2 / 12. A ramp visits it evenly, to one count in kSteps.
  EXPECT_NEAR(sum / kSteps, 0.0, 1e-2 * step);
  EXPECT_NEAR(squares / kSteps, step * step / 12.0, 1e-2 * step * step / 12.0);
}

TEST_F(SensingTest, NoiseIsWhiteNormalAndItsOwnPerJoint) {
  Sensing sensing =
      Make({.joint_noise = {.groups = {{"rf", 1e-3}, {"rf1_1", 2e-3}}, .key = "sensing.joint_noise"}});
  const int named = model_.FindJoint("rf1_1"), other = model_.FindJoint("rf2_1"),
            none = model_.FindJoint("r_elbow");
  constexpr int kSteps = 20000;
  double s_named = 0.0, s_other = 0.0, cross = 0.0, lag_one = 0.0, fourth = 0.0, last = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    Measure(sensing);
    const double a = (MeasuredJoint(named) - 0.1) / 2e-3, b = (MeasuredJoint(other) - 0.1) / 1e-3;
    EXPECT_EQ(MeasuredJoint(none), 0.1);
    s_named += a * a;
    s_other += b * b;
    fourth += a * a * a * a;
    cross += a * b;
    lag_one += a * last;
    last = a;
  }
  // Sums of kSteps independent numbers: five standard deviations.
  const double spread = 5.0 / std::sqrt(static_cast<double>(kSteps));
  EXPECT_NEAR(s_named / kSteps, 1.0, std::sqrt(2.0) * spread);
  EXPECT_NEAR(s_other / kSteps, 1.0, std::sqrt(2.0) * spread);
  EXPECT_NEAR(fourth / kSteps, 3.0, std::sqrt(96.0) * spread);
  EXPECT_NEAR(cross / kSteps, 0.0, spread);
  EXPECT_NEAR(lag_one / kSteps, 0.0, spread);
}

TEST_F(SensingTest, EachSourceHasItsOwnNumbers) {
  SensingOptions both{
      .joint_noise = {.all = 1e-3}, .velocity_noise = {.all = 1e-2}, .object_position_noise = 1e-3};
  SensingOptions one = both;
  one.joint_noise = {};
  Sensing with = Make(both), without = Make(one), other_seed = Make(both, 2);
  for (int k = 0; k < 5; ++k) {
    const Reading a = Measure(with), b = Measure(without), c = Measure(other_seed);
    EXPECT_EQ(a.state.xi, b.state.xi);
    EXPECT_EQ(a.state.X_Bo.matrix(), b.state.X_Bo.matrix());
    EXPECT_NE(a.state.q, b.state.q);
    EXPECT_NE(a.state.q, c.state.q);
    EXPECT_NE(a.state.xi, c.state.xi);
  }
}

TEST_F(SensingTest, FilteredDifferencesHaveTheLowPassesTransferFunction) {
  constexpr double kCutoff = 20.0;
  for (const double f : {2.0, 20.0, 60.0}) {
    Sensing sensing = Make({.velocity = VelocitySource::kDifferenced, .velocity_cutoff = kCutoff});
    std::complex<double> in = 0.0, out = 0.0;
    constexpr int kSettle = 200, kSteps = 1000;  // whole periods of all three
    for (int k = 0; k < kSettle + kSteps; ++k) {
      const double phase = 2.0 * kPi * f * kDt * k;
      const double last = Joint(0);
      Joint(0) = std::sin(phase);
      Measure(sensing);
      if (k < kSettle) continue;
      const std::complex<double> turn = std::polar(1.0, -phase);
      in += turn * ((Joint(0) - last) / kDt);
      out += turn * MeasuredRate(0);
    }
    // y += a (u - y), z transform a / (1 - (1 - a) / z)
    const double a = 1.0 - std::exp(-2.0 * kPi * kCutoff * kDt);
    const std::complex<double> z = std::polar(1.0, 2.0 * kPi * f * kDt);
    const std::complex<double> discrete = a / (1.0 - (1.0 - a) / z);
    EXPECT_LT(std::abs(out / in - discrete), 1e-9) << f;
    // And 1 / (1 + j f / f_c), but for half a step of delay that sampling adds.
    EXPECT_NEAR(std::abs(discrete), 1.0 / std::sqrt(1.0 + f * f / kCutoff / kCutoff), 2e-2) << f;
  }
}

TEST_F(SensingTest, DifferencesOfExactPositionsAreTheVelocities) {
  Sensing sensing = Make({.velocity = VelocitySource::kDifferenced});
  Measure(sensing);
  for (int k = 0; k < 3; ++k) {
    Joint(5) += kDt * 0.7;
    Measure(sensing);
    EXPECT_NEAR(MeasuredRate(5), 0.7, 1e-12);
  }
}

TEST_F(SensingTest, LatencyIsWholeSamplesOfEverything) {
  Sensing sensing = Make({.latency = 3 * kDt});
  for (int k = 0; k < 10; ++k) {
    truth_.state.q.setConstant(k);
    truth_.state.xi.setConstant(10.0 + k);
    truth_.state.X_Bo.translation().setConstant(20.0 + k);
    truth_.touch.support_force = 30.0 + k;
    Measure(sensing);
    const double late = std::max(0, k - 3);
    EXPECT_EQ(measured_.state.q[7], late);
    EXPECT_EQ(measured_.state.xi[7], 10.0 + late);
    EXPECT_EQ(measured_.state.X_Bo.translation().x(), 20.0 + late);
    EXPECT_EQ(measured_.touch.support_force, 30.0 + late);
  }
}

TEST_F(SensingTest, ACameraIsLateAndSeesNowAndThen) {
  Sensing sensing = Make({.object_rate = 250.0, .object_latency = 2 * kDt});
  for (int k = 0; k < 20; ++k) {
    truth_.state.X_Bo.translation().setConstant(k);
    truth_.state.q.setConstant(k);
    Measure(sensing);
    const int seen = k < 2 ? 0 : (k - 2) / 4 * 4;
    EXPECT_EQ(measured_.state.X_Bo.translation().x(), seen) << k;
    EXPECT_EQ(measured_.state.q[7], k);
  }
}

TEST_F(SensingTest, ACameraWithAFilterKnowsAConstantMotion) {
  Sensing sensing = Make({.object_rate = 200.0,
                          .object_latency = 8 * kDt,
                          .object_velocity = VelocitySource::kKalman,
                          .object_acceleration = 5.0});
  const Vector3d p_dot(0.3, -0.1, 0.05), omega(0.2, 0.4, -0.3);
  truth_.state.V_Bo.setZero();
  for (int k = 0; k < 2000; ++k) {
    truth_.state.V_Bo << truth_.state.X_Bo.linear().transpose() * p_dot, omega;
    Measure(sensing);
    if (k >= 1500) {
      // Exact measurements of a motion without acceleration: the estimate converges on it, latency and all.
      EXPECT_LT((measured_.state.X_Bo.translation() - truth_.state.X_Bo.translation()).norm(), 1e-9);
      EXPECT_LT(LogSo3(measured_.state.X_Bo.linear().transpose() * truth_.state.X_Bo.linear()).norm(), 1e-9);
      EXPECT_LT((measured_.state.V_Bo - truth_.state.V_Bo).norm(), 1e-7);
    }
    truth_.state.X_Bo.translation() += kDt * p_dot;
    truth_.state.X_Bo.linear() = truth_.state.X_Bo.linear() * ExpSo3(kDt * omega);
  }
}

TEST_F(SensingTest, NoiseOfTheObjectHasItsSize) {
  Sensing sensing = Make({.object_position_noise = 1e-3, .object_orientation_noise = 2e-3});
  double position = 0.0, orientation = 0.0;
  constexpr int kSteps = 5000;
  for (int k = 0; k < kSteps; ++k) {
    Measure(sensing);
    position += (measured_.state.X_Bo.translation() - truth_.state.X_Bo.translation()).squaredNorm();
    orientation +=
        LogSo3(measured_.state.X_Bo.linear().transpose() * truth_.state.X_Bo.linear()).squaredNorm();
  }
  const double spread = 5.0 * std::sqrt(2.0 / (3.0 * kSteps));
  EXPECT_NEAR(position / (3.0 * kSteps), 1e-6, spread * 1e-6);
  EXPECT_NEAR(orientation / (3.0 * kSteps), 4e-6, spread * 4e-6);
}

TEST_F(SensingTest, OdometryIntegratesTheWheels) {
  Sensing sensing = Make({.odometry = true});
  const double v = 0.4, w = 0.5;
  truth_.state.q.head<3>() << 1.0, 2.0, 0.3;
  truth_.state.xi.head<2>() << v, w;
  for (int k = 0; k <= 1000; ++k) {
    Measure(sensing);
    truth_.state.q.head<3>().setConstant(9.0);  // the true pose is not looked at again
  }
  // A circle of radius v / w through 0.5 rad; the midpoint rule is off by w^2 dt^2 / 24 of the way.
  EXPECT_NEAR(measured_.state.q[2], 0.8, 1e-9);
  EXPECT_NEAR(measured_.state.q[0], 1.0 + v / w * (std::sin(0.8) - std::sin(0.3)), 1e-8);
  EXPECT_NEAR(measured_.state.q[1], 2.0 - v / w * (std::cos(0.8) - std::cos(0.3)), 1e-8);
  sensing.Translate(Vector3d(-1.0, -2.0, 0.0));
  Measure(sensing);
  EXPECT_NEAR(measured_.state.q[0], v / w * (std::sin(0.8) - std::sin(0.3)), 1e-3);
}

TEST_F(SensingTest, AGroupThatIsNoJointIsRefused) {
  const SensingOptions options{.joint_noise = {.groups = {{"r_elbov", 1.0}}, .key = "sensing.joint_noise"}};
  EXPECT_TRUE(Throws<InputError>([&] { return Make(options); },
                                 R"(s.toml: sensing.joint_noise: fits no name of the robot ("r_elbow"?))"));
}

}  // namespace
}  // namespace dexcheck::testing::sensing_test
