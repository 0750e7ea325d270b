// The engine as plant: what is read of it, and what stands between it and the controller.

#include "harness/plant/engine_plant.h"

#include <gtest/gtest.h>

#include "harness/plant/sensing.h"
#include "tests/common/matrix_near.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::engine_plant_test {
namespace {

class EnginePlantTest : public ::testing::Test {
 protected:
  EnginePlantTest()
      : scenario_("curve"),
        setup_(scenario_.setup()),
        plant_(setup_.adapter(), setup_.fingertips(), setup_.surface(), /*implicit_damping=*/false) {
    plant_.Place(setup_.start().q, setup_.start().X_Bo);
    tau_.setZero(setup_.model().num_velocities());
  }

  void Step() {
    plant_.BeginStep();
    plant_.Read(&reading_);
    plant_.EndStep(tau_);
    plant_.Read(&response_);
  }

  ShippedRun scenario_;
  const dexcheck::Setup& setup_;
  EnginePlant plant_;
  VectorXd tau_;
  PlantReading reading_;
  PlantResponse response_;
};

// qpos keeps quaternions; the start's contacts overlap by 1e-6 m.
constexpr double kRounding = 1e-12;

TEST_F(EnginePlantTest, ReadsWhereRobotAndObjectWerePlaced) {
  Step();
  EXPECT_TRUE(MatrixNear(reading_.state.q, setup_.start().q, kRounding));
  EXPECT_TRUE(
      MatrixNear(reading_.state.X_Bo.matrix().eval(), setup_.start().X_Bo.matrix().eval(), kRounding));
  EXPECT_EQ(reading_.state.xi.norm(), 0.0);
  EXPECT_EQ(reading_.touch.fingertips, AllContacts(4));
  EXPECT_NEAR(reading_.departure.tilt, 0.0, kRounding);
  for (const double overlap : reading_.state.overlap) EXPECT_NEAR(overlap, 1e-6, 1e-7);
  for (const PlantContact& contact : response_.contacts) EXPECT_TRUE(contact.touching);
  EXPECT_EQ(response_.fingertips.size(), 4U);
  EXPECT_EQ(response_.wheels.size(), 2U);
  EXPECT_EQ(response_.support_force, 0.0);
}

// Accelerations are those of the step: v(t + dt) = v(t) + dt a. V_Bo is in axes that turn meanwhile, and
// contacts have just begun: what is left is of the order of dt, measured 4e-3.
TEST_F(EnginePlantTest, RespondsWithTheAccelerationsOfTheStep) {
  tau_.setConstant(0.05);
  Step();
  const PlantReading before = reading_;
  const PlantResponse response = response_;
  Step();
  const double dt = plant_.time_step();
  ASSERT_GT(response.xi_dot.norm(), 1.0);
  EXPECT_TRUE(MatrixNear(VectorXd((reading_.state.xi - before.state.xi) / dt), response.xi_dot, 1e-3));
  EXPECT_TRUE(MatrixNear(Vector6d((reading_.state.V_Bo - before.state.V_Bo) / dt), response.V_Bo_dot, 2e-2));
}

TEST_F(EnginePlantTest, MovesAsAWhole) {
  Step();
  const PlantReading before = reading_;
  const Vector3d v(0.5, 0.0, 0.0);
  plant_.Place(setup_.start().q, setup_.start().X_Bo);
  plant_.AddVelocity(reading_.state, v);
  plant_.Translate(Vector3d(0.25, -0.125, 0.0));
  Step();
  EXPECT_NEAR(reading_.state.xi[0], 0.5, kRounding);
  EXPECT_TRUE(MatrixNear(reading_.state.xi.tail(reading_.state.xi.size() - 1).eval(),
                         VectorXd::Zero(reading_.state.xi.size() - 1).eval(), kRounding));
  const Vector3d v_Bo = reading_.state.X_Bo.linear() * reading_.state.V_Bo.head<3>();
  EXPECT_TRUE(MatrixNear(v_Bo, v, kRounding));
  EXPECT_NEAR(reading_.state.q[0] - before.state.q[0], 0.25, kRounding);
  EXPECT_NEAR(reading_.state.q[1] - before.state.q[1], -0.125, kRounding);
  const Vector3d moved = reading_.state.X_Bo.translation() - before.state.X_Bo.translation();
  EXPECT_TRUE(MatrixNear(moved, Vector3d(0.25, -0.125, 0.0), kRounding));
}

TEST_F(EnginePlantTest, TheControllerMeasuresTheTrueStateUnlessDeclaredOtherwise) {
  Step();
  Reading measured;
  Sensing({}, setup_.MakePartContext()).Measure(reading_, &measured);
  EXPECT_EQ(measured.state.q, reading_.state.q);
  EXPECT_EQ(measured.state.xi, reading_.state.xi);
  EXPECT_EQ(measured.state.X_Bo.matrix(), reading_.state.X_Bo.matrix());
  EXPECT_EQ(measured.state.V_Bo, reading_.state.V_Bo);
  EXPECT_EQ(measured.state.overlap, reading_.state.overlap);
  EXPECT_EQ(measured.touch.fingertips, reading_.touch.fingertips);
  const auto difference = [&](size_t i) {
    return Vector5d(measured.state.kappa[i].CalcVector() - reading_.state.kappa[i].CalcVector());
  };
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(difference(i).norm(), 0.0);
  Sensing({.contact_error = 0.25}, setup_.MakePartContext()).Measure(reading_, &measured);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(difference(i)[2], 0.25, kRounding);
    EXPECT_NEAR(difference(i).norm(), 0.25, kRounding);
  }
  EXPECT_EQ(measured.state.q, reading_.state.q);
}

/// An object that falls freely under a push: impulse is momentum, moment's impulse is angular momentum.
TEST_F(EnginePlantTest, APushIsItsImpulse) {
  Pose X_Bo = setup_.start().X_Bo;
  X_Bo.translation() += Vector3d(3.0, 3.0, 2.0);
  plant_.Place(setup_.start().q, X_Bo);
  const MassProperties& body = setup_.object().body;
  Wrench push;
  push.force = Vector3d(1.0, 20.0, -2.0);
  constexpr int kSteps = 10;
  Vector3d moment_impulse = Vector3d::Zero();
  for (int k = 0; k < 2 * kSteps; ++k) {
    plant_.BeginStep();
    plant_.Read(&reading_);
    push.point = reading_.state.X_Bo * Vector3d(0.002, 0.0, 0.001);
    const Vector3d arm = push.point - reading_.state.X_Bo.translation();
    if (k < kSteps) moment_impulse += plant_.time_step() * arm.cross(push.force);
    plant_.Push(k < kSteps ? std::span<const Wrench>(&push, 1) : std::span<const Wrench>());
    plant_.EndStep(tau_);
    plant_.Read(&response_);
  }
  plant_.BeginStep();
  plant_.Read(&reading_);
  const MeasuredState& state = reading_.state;
  const double time = kSteps * plant_.time_step();
  const Vector3d momentum = body.mass * (state.X_Bo.linear() * state.V_Bo.head<3>());
  const Vector3d impulse = time * push.force + 2.0 * time * body.mass * setup_.model().gravity();
  EXPECT_TRUE(MatrixNear(momentum, impulse, kRounding));
  const Vector3d angular = state.X_Bo.linear() * (body.inertia * state.V_Bo.tail<3>());
  ASSERT_GT(angular.norm(), 1e-4);
  // The engine steps omega, not the angular momentum: of first order in dt, measured 4e-3.
  EXPECT_TRUE(MatrixNear(angular, moment_impulse, 2e-2 * angular.norm()));
}

}  // namespace
}  // namespace dexcheck::testing::engine_plant_test
