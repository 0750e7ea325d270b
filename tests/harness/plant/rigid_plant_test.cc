// The paper's own simulation as plant: its order, its constraints, (57) under the law, and the
// engine beside it.

#include "harness/plant/rigid_plant.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "controller/control/trajectory_controller.h"
#include "harness/plant/engine_plant.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck::testing::rigid_plant_test {
namespace {

const std::string kRigid = "plant.type=rigid";
const std::string kEuler = "plant.type=rigid_euler";

class RigidPlantTest : public ::testing::Test {
 protected:
  RigidPlantTest() : shipped_("hold", {kRigid}), setup_(shipped_.setup()) {}

  std::unique_ptr<RigidPlant> MakePlant(double time_step,
                                        Integrator integrator = Integrator::kRungeKutta4) const {
    const RigidPlantOptions options{.time_step = time_step, .integrator = integrator, .finger_friction = 1.0};
    auto plant =
        std::make_unique<RigidPlant>(setup_.model(), setup_.adapter(), setup_.fingertips(), motors_, options);
    plant->Place(setup_.start().q, setup_.start().X_Bo);
    return plant;
  }

  /// Torques that hold robot and object, and a drive forward, a turn and a bend of the elbow besides.
  VectorXd MakeTorques() const {
    TrajectoryController law(setup_.model(), setup_.fingertips(), setup_.object().body, setup_.surface(),
                             setup_.MakeControllerOptions(), {});
    const auto rest = MakeLineTrajectory(setup_.start().X_o, Vector6d::Zero(), 0.0);
    law.Follow(*rest);
    const std::unique_ptr<RigidPlant> plant = MakePlant(1e-3);
    PlantReading reading;
    plant->BeginStep();
    plant->Read(&reading);
    Command command;
    law.Step({reading.state, reading.touch}, 0.0, &command);
    VectorXd tau = command.tau;
    tau[0] += 6.0;
    tau[1] += 4.0;
    tau[7] += 3.0;
    return tau;
  }

  static void Step(RigidPlant* plant, const VectorXd& tau, PlantReading* reading) {
    plant->BeginStep();
    plant->Read(reading);
    plant->EndStep(tau);
  }

  /// The state after kDuration under constant torques.
  VectorXd Simulate(double time_step, Integrator integrator) {
    const std::unique_ptr<RigidPlant> plant = MakePlant(time_step, integrator);
    const VectorXd tau = MakeTorques();
    PlantReading reading;
    for (long i = 0; i < std::lround(kDuration / time_step); ++i) Step(plant.get(), tau, &reading);
    plant->BeginStep();
    plant->Read(&reading);
    const MeasuredState& state = reading.state;
    VectorXd all(state.q.size() + state.xi.size() + 12 + 6);
    all << state.q, state.xi, state.X_Bo.matrix().topRows<3>().reshaped(), state.V_Bo;
    return all;
  }

  static constexpr double kDuration = 0.2;  // s

  ShippedRun shipped_;
  const dexcheck::Setup& setup_;
  std::vector<Motor> motors_;
};

TEST_F(RigidPlantTest, RungeKuttaHasFourthOrder) {
  const VectorXd coarse = Simulate(0.005, Integrator::kRungeKutta4);
  const VectorXd fine = Simulate(0.0025, Integrator::kRungeKutta4);
  const VectorXd finest = Simulate(0.00125, Integrator::kRungeKutta4);
  const VectorXd start = [&] {
    PlantReading reading;
    const std::unique_ptr<RigidPlant> plant = MakePlant(1e-3);
    plant->BeginStep();
    plant->Read(&reading);
    return reading.state.q;
  }();
  ASSERT_GT((finest.head(start.size()) - start).norm(), 1e-3);
  // 2^4 = 16
  const double ratio = (coarse - fine).norm() / (fine - finest).norm();
  EXPECT_GT(ratio, 12.0);
  EXPECT_LT(ratio, 24.0);
}

TEST_F(RigidPlantTest, SemiImplicitEulerHasFirstOrder) {
  const VectorXd exact = Simulate(0.0025, Integrator::kRungeKutta4);
  const double coarse = (Simulate(0.002, Integrator::kSemiImplicitEuler) - exact).norm();
  const double fine = (Simulate(0.001, Integrator::kSemiImplicitEuler) - exact).norm();
  EXPECT_NEAR(coarse / fine, 2.0, 0.1);
}

TEST_F(RigidPlantTest, ContactsStayClosedAndRoll) {
  for (const Integrator integrator : {Integrator::kRungeKutta4, Integrator::kSemiImplicitEuler}) {
    const std::unique_ptr<RigidPlant> plant = MakePlant(1e-3, integrator);
    const VectorXd tau = MakeTorques();
    PlantReading reading;
    PlantResponse response;
    double gap = 0.0, slip = 0.0, rolled = 0.0;
    std::vector<ContactCoordinates> first;
    for (int i = 0; i < 200; ++i) {
      Step(plant.get(), tau, &reading);
      plant->Read(&response);
      if (first.empty()) first = reading.state.kappa;
      for (size_t k = 0; k < 4; ++k) {
        gap = std::max(gap, std::abs(response.contacts[k].distance));
        slip = std::max(slip, response.fingertips[k].slip.norm());
        rolled = std::max(rolled, std::abs(reading.state.kappa[k].alpha_f.u - first[k].alpha_f.u));
      }
    }
    EXPECT_GT(rolled, 1e-4);
    const bool fourth = integrator == Integrator::kRungeKutta4;
    // Euler's velocities are half a step older: slip is h / 2 of its rate. Measured 1e-5 m, 3e-3 m/s
    // of joints at 13 rad/s; by Runge-Kutta 5e-11 m, 1.3e-9 m/s.
    EXPECT_LT(gap, fourth ? 5e-10 : 5e-5);
    EXPECT_LT(slip, fourth ? 1e-8 : 1e-2);
  }
}

// A push on a link and one on the object: known to the checks, and the engine's robot goes where the rigid
// one does.
TEST(RigidRun, PushesMoveItAsTheEngine) {
  const auto finish = [](const std::string& plant, bool pushed,
                         const std::string& step = "plant.time_step=1e-3") {
    const std::string pushes =
        "disturbance=[{ type = 'step', body = 'r_forearm', force = [0, 3, 1] }, { type = 'pulse', body = "
        "'object', force = [0, 0, 0.5], torque = [0, 0.01, 0], begin = 0.1, duration = 0.1 }]";
    ShippedRun run(
        "hold", {plant, step, "duration=0.3", "settle=0.3", "expect={}", pushed ? pushes : "disturbance=[]"});
    const RunResult& result = run.Run();
    if (plant != "plant.type=engine") {
      EXPECT_TRUE(Passes(result));
      EXPECT_LE(run.Worst("inverse_dynamics_robot"), 1e-10);
      EXPECT_LE(run.Worst("inverse_dynamics_object"), 1e-10);
    }
    return VectorXd(run.step().reading.state.q);
  };
  const VectorXd rigid = finish(kEuler, true);
  const double moved = (rigid - finish(kEuler, false)).norm();
  EXPECT_GT(moved, 1e-4);
  EXPECT_LT((rigid - finish("plant.type=engine", true)).norm(), 0.02 * moved);
  // Semi-implicit Euler's velocities are h / 2 old, and a push that begins acts on them h / 2 early. Together
  // they shift the motion by h in time, at rates of the loop that are at most K_v = 2 omega: h K_v of the
  // motion, measured 0.022.
  const double most = 1e-3 * 2.0 * 20.0;
  const VectorXd apart = rigid - finish(kRigid, true);
  EXPECT_LT(apart.norm(), most * moved);
  // The error is of first order: half the step leaves half of it, but for such a fraction of the rest.
  const std::string kHalf = "plant.time_step=5e-4";
  const VectorXd half = finish(kEuler, true, kHalf) - finish(kRigid, true, kHalf);
  EXPECT_LT((2.0 * half - apart).norm(), 2.0 * most * apart.norm());
}

/// Returns the positions of object and robot at the end of a run.
VectorXd Finish(std::vector<std::string> overrides) {
  overrides.insert(overrides.end(), {"duration=1.0", "settle=0.5"});
  ShippedRun run("paper-ramp", overrides);
  const RunResult& result = run.Run();
  EXPECT_TRUE(result.failure.empty()) << result.failure;
  return run.step().reading.state.q;
}

// Side by side under the same law: what parts the two is how soft the engine's contacts are.
TEST(RigidRun, TheEngineComesToItAsItsContactsBecomeStiff) {
  const VectorXd rigid = Finish({kEuler});
  const double soft = (Finish({"plant.contact_impedance=0.9"}) - rigid).norm();
  const double stiff = (Finish({"plant.contact_impedance=0.99"}) - rigid).norm();
  EXPECT_GT(soft, 1e-9);
  // (1 - d) / d is 11 times smaller.
  EXPECT_GT(soft / stiff, 5.0);
}

// Whatever a scenario holds and with which robot; those that the plant refuses say why.
TEST(RigidRun, EveryScenarioThatItTakesPasses) {
  int passed = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/harness/shipped/scenarios"))) {
    if (entry.path().extension() != ".toml") continue;
    const std::string name = entry.path().stem().string();
    if (name == "paper-rest") continue;  // whose wheels are asked for more than they can give
    SCOPED_TRACE(name);
    std::unique_ptr<ShippedRun> run;
    try {
      run =
          std::make_unique<ShippedRun>(name, std::vector<std::string>{kEuler, "duration=0.05", "settle=0.1"});
    } catch (const InputError& error) {
      const std::string why = error.what();
      EXPECT_TRUE(why.find("bonded") != std::string::npos || why.find("task") != std::string::npos ||
                  why.find("feet") != std::string::npos)
          << why;
      continue;
    }
    const RunResult& result = run->Run();
    EXPECT_TRUE(Passes(result));
    ++passed;
  }
  EXPECT_GE(passed, 12);
}

// Changes of the parameter file by the scenario apply to the scene's robot; changes by --set apply to the
// controller's alone.
TEST(RigidRun, IsOfTheScenariosRobot) {
  const ShippedRun ring("two-hands", {kRigid, "model.object.mass=1.1"});
  EXPECT_EQ(ring.setup().robots().rigid->object()->body.mass, 1.0);
  EXPECT_EQ(ring.setup().model().object()->body.mass, 1.1);
  const ShippedRun believed("hold", {kRigid, "model.object.mass=0.21"});
  EXPECT_EQ(believed.setup().robots().rigid->object()->body.mass, 0.2);
}

}  // namespace
}  // namespace dexcheck::testing::rigid_plant_test
