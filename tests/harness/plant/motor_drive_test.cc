// Torques of the motors against the meaning of their keys: delays, transfer functions, steps, friction.

#include "harness/plant/motor_drive.h"

#include <gtest/gtest.h>

#include <complex>
#include <limits>

#include "controller/common/errors.h"
#include "tests/common/paper_robot.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::motor_drive_test {
namespace {

constexpr double kDt = 1e-3;
constexpr double kLimit = 40.0;

class MotorDriveTest : public ::testing::Test {
 protected:
  MotorDriveTest() : model_(ReadPaperRobot()) {
    motors_.push_back({model_.base().wheel_joint_right, kLimit});
    motors_.push_back({model_.base().wheel_joint_left, kLimit});
    for (const Joint& joint : model_.joints()) motors_.push_back({joint.name, kLimit});
    tau_ = xi_ = VectorXd::Zero(model_.num_velocities());
  }
  [[nodiscard]] MotorDrive Make(const ActuationOptions& options) const {
    return {motors_, options, PartContext{&model_, 4, kDt, 1, "s.toml"}};
  }
  /// Returns the torque that a joint's motor delivers for u.
  double Give(MotorDrive& drive, double u) {
    tau_[kJoint] = u;
    drive.Apply(tau_, xi_, &output_);
    return output_.tau[kJoint];
  }

  static constexpr int kJoint = 5;  // a shoulder's
  RobotModel model_;
  std::vector<Motor> motors_;
  VectorXd tau_, xi_;
  DriveOutput output_;
};

TEST_F(MotorDriveTest, WithoutFaultsTorquesArriveAsTheyAre) {
  MotorDrive drive = Make({});
  for (const double u : {0.1, -3.7, 40.0}) EXPECT_EQ(Give(drive, u), u);
  EXPECT_EQ(output_.effort, 1.0);
  EXPECT_EQ(output_.busiest_motor, kJoint);
  EXPECT_TRUE(Throws<RunFailure>([&] { return Give(drive, 50.0); }, "is at its limit, 40 N m"));
  EXPECT_EQ(output_.effort, 1.25);  // what ended the run can be read
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(Throws<RunFailure>([&] { return Give(drive, nan); }, "is not a number"));
}

TEST_F(MotorDriveTest, DelaysAreTimeAlsoBetweenSteps) {
  for (const double steps : {1.0, 3.0, 0.25, 2.5}) {
    MotorDrive drive = Make({.delay = steps * kDt});
    (void)Give(drive, 0.0);
    // An impulse of one step: the same impulse comes out, its centre `steps` later.
    double sum = 0.0, moment = 0.0;
    for (int k = 0; k < 10; ++k) {
      const double given = Give(drive, k == 0 ? 1.0 : 0.0);
      sum += given;
      moment += given * k;
      if (steps == std::floor(steps)) EXPECT_EQ(given, k == static_cast<int>(steps) ? 1.0 : 0.0);
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
    EXPECT_NEAR(moment, steps, 1e-12);
  }
}

TEST_F(MotorDriveTest, LagHasItsTransferFunction) {
  constexpr double kLag = 5e-3;
  for (const double f : {5.0, 25.0, 100.0}) {
    MotorDrive drive = Make({.lag = {.all = kLag}});
    std::complex<double> in = 0.0, out = 0.0;
    constexpr int kSettle = 200, kSteps = 1000;
    for (int k = 0; k < kSettle + kSteps; ++k) {
      const double phase = 2.0 * kPi * f * kDt * k;
      const double given = Give(drive, std::sin(phase));
      if (k < kSettle) continue;
      in += std::polar(1.0, -phase) * std::sin(phase);
      out += std::polar(1.0, -phase) * given;
    }
    // The mean over a step of 1 / (1 + T s) behind a hold: for y_k at the step's beginning,
    // y_{k+1} = d y_k + (1 - d) u_k and given = u + (y_k - u) c, c = (1 - d) T / dt.
    const double d = std::exp(-kDt / kLag), c = (1.0 - d) * kLag / kDt;
    const std::complex<double> z = std::polar(1.0, 2.0 * kPi * f * kDt);
    const std::complex<double> discrete = 1.0 - c + c * (1.0 - d) / (z - d);
    EXPECT_LT(std::abs(out / in - discrete), 1e-9) << f;
    const std::complex<double> continuous = 1.0 / std::complex<double>(1.0, 2.0 * kPi * f * kLag);
    // A held sine and a continuous one differ by the hold's own half a period squared.
    const double hold = 2.0 * kPi * f * kDt;
    EXPECT_LT(std::abs(discrete - continuous), 0.1 * hold * hold + 0.02 * hold) << f;
  }
}

TEST_F(MotorDriveTest, StepsAndGainErrors) {
  MotorDrive drive = Make(
      {.torque_step = {.all = 0.25}, .gain_error = {.groups = {{motors_[kJoint].name, 0.02}}, .key = "k"}});
  EXPECT_NEAR(Give(drive, 1.1), 1.02 * 1.0, 1e-15);
  EXPECT_NEAR(Give(drive, 1.13), 1.02 * 1.25, 1e-15);
  tau_[kJoint + 1] = 1.1;
  (void)Give(drive, 0.0);
  EXPECT_EQ(output_.tau[kJoint + 1], 1.0);
}

TEST_F(MotorDriveTest, ASaturatingMotorDeliversItsLimitAndReportsIt) {
  MotorDrive drive = Make({.saturate = true});
  EXPECT_EQ(Give(drive, 50.0), kLimit);
  EXPECT_EQ(output_.effort, 50.0 / kLimit);
  EXPECT_EQ(output_.busiest_motor, kJoint);
  EXPECT_EQ(Give(drive, -50.0), -kLimit);
}

TEST_F(MotorDriveTest, AStatedLimitTakesTheMotorsPlace) {
  MotorDrive drive = Make({.limit = {.groups = {{motors_[kJoint].name, 3.0}}, .key = "actuation.limit"}});
  EXPECT_EQ(Give(drive, 50.0), 3.0);
  EXPECT_EQ(output_.cut[kJoint], 47.0);
  EXPECT_EQ(Give(drive, -2.0), -2.0);
  EXPECT_EQ(output_.cut[kJoint], 0.0);
  tau_[kJoint + 1] = 2.0 * kLimit;
  (void)Give(drive, 0.0);
  EXPECT_EQ(output_.tau[kJoint + 1], kLimit);
}

TEST_F(MotorDriveTest, FrictionIsCoulombsFarFromRestAndStribecksNearIt) {
  MotorDrive drive = Make({.coulomb = {.all = 0.3}, .stribeck = {.all = 0.2}, .stribeck_velocity = 0.1});
  xi_[kJoint] = 2.0;
  EXPECT_NEAR(Give(drive, 1.0), 1.0 - 0.3, 1e-12);
  xi_[kJoint] = -2.0;
  EXPECT_NEAR(Give(drive, 1.0), 1.0 + 0.3, 1e-12);
  xi_[kJoint] = 0.1;
  EXPECT_NEAR(Give(drive, 1.0), 1.0 - 0.3 - 0.2 * std::exp(-1.0), 1e-12);
  xi_[kJoint] = 0.0;
  EXPECT_EQ(Give(drive, 1.0), 1.0);
  // It never drives: a joint of its armature alone does not turn round within a step.
  const double armature = model_.joints()[kJoint - 2].armature;
  for (const double w : {1e-3, 1e-2, 0.1}) {
    xi_[kJoint] = w;
    EXPECT_GE(w + kDt * Give(drive, 0.0) / armature, 0.0);
  }
}

TEST_F(MotorDriveTest, AWheelsFrictionTurnsWithTheWheel) {
  MotorDrive drive = Make({.coulomb = {.all = 0.3}});
  xi_[0] = 1.0;  // v_c
  (void)Give(drive, 0.0);
  EXPECT_NEAR(output_.tau[0], -0.3, 1e-12);
  EXPECT_NEAR(output_.tau[1], -0.3, 1e-12);
  xi_[0] = 0.0;
  xi_[1] = 1.0;  // w_c: the right wheel forward
  (void)Give(drive, 0.0);
  EXPECT_NEAR(output_.tau[0], -0.3, 1e-12);
  EXPECT_NEAR(output_.tau[1], 0.3, 1e-12);
}

TEST_F(MotorDriveTest, BacklashIsCrossedByTheRotorAlone) {
  constexpr double kPlay = 1e-3, kTorque = 0.4;
  MotorDrive drive = Make({.backlash = {.all = kPlay}});
  EXPECT_EQ(Give(drive, kTorque), kTorque);
  // The rotor needs sqrt(2 play J / tau) to the other side.
  const double armature = model_.joints()[kJoint - 2].armature;
  const double expected = std::sqrt(2.0 * kPlay * armature / kTorque);
  int steps = 0;
  while (Give(drive, -kTorque) == 0.0 && steps < 1000) ++steps;
  EXPECT_NEAR(steps * kDt, expected, 2.0 * kDt);
  EXPECT_GT(steps, 5);
  EXPECT_EQ(Give(drive, -kTorque), -kTorque);
}

TEST_F(MotorDriveTest, FrictionWithoutArmatureIsRefused) {
  RobotSpec spec = model_.spec();
  spec.joints[kJoint - 2].armature = 0.0;
  const RobotModel bare(spec);
  ActuationOptions options{.coulomb = {.all = 0.1, .key = "actuation.coulomb"}};
  EXPECT_TRUE(Throws<InputError>(
      [&] {
        return MotorDrive(motors_, options, PartContext{&bare, 4, kDt, 1, "s.toml"});
      },
      "s.toml: actuation.coulomb: needs a joint with armature, got"));
}

}  // namespace
}  // namespace dexcheck::testing::motor_drive_test
