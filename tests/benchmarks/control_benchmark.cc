// Time of one control step of the paper's robot with four contacts, and of its parts.

#include <benchmark/benchmark.h>

#include "controller/control/computed_torque.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/control/object_tracking.h"
#include "controller/control/posture_task.h"
#include "tests/controller/control/grasp_scene.h"

namespace dexcheck {
namespace {

using testing::GraspScene;

/// A grasp in motion, and all that a step takes.
struct Step {
  explicit Step(RedundancyWeight::Kind kind = RedundancyWeight::Kind::kIdentity)
      : law(scene.model, scene.grasp.num_contacts(), {kind, VectorXd::Ones(scene.robot.size())}),
        dynamics(scene.model, scene.grasp.num_contacts()),
        task(scene.model),
        sigma_prime(VectorXd::Zero(scene.robot.size())) {
    std::mt19937 random(1);
    scene.DrawVelocities(&random, 0.5);
    F_N = scene.CalcInternalForce(3.0);
    desired.X_d = scene.X_o;
    gains.K_v.setConstant(20.0);
    gains.K_p.setConstant(100.0);
  }
  GraspScene scene;
  ComputedTorque law;
  ConstrainedDynamics dynamics;
  PostureTask task;
  VectorXd sigma_prime, F_N;
  DesiredMotion desired;
  ObjectGains gains;
};

void RobotTerms(benchmark::State& state) {
  Step step;
  for (auto _ : state) {
    step.scene.robot.SetState(step.scene.q, step.scene.xi);
    step.scene.robot.CalcDynamics();
    benchmark::ClobberMemory();
  }
}
BENCHMARK(RobotTerms)->Unit(benchmark::kMicrosecond);

void ContactAndObjectTerms(benchmark::State& state) {
  Step step;
  GraspScene& scene = step.scene;
  for (auto _ : state) {
    scene.grasp.SetState(scene.robot, scene.X_o, scene.X_o_dot, scene.kappa);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(ContactAndObjectTerms)->Unit(benchmark::kMicrosecond);

/// The same of a growing number of contacts, on the robot's eight fingertips in turn.
void GrowingGrasp(benchmark::State& state) {
  Step step;
  GraspScene& scene = step.scene;
  std::vector<int> fingertips;
  std::vector<ContactCoordinates> kappa;
  for (size_t i = 0; i < static_cast<size_t>(state.range(0)); ++i) {
    fingertips.push_back(scene.model.fingertips()[i % scene.model.fingertips().size()]);
    kappa.push_back(scene.kappa[i % scene.kappa.size()]);
  }
  GraspTerms grasp(scene.model, fingertips, scene.model.object()->body, scene.grasp.surface());
  for (auto _ : state) {
    grasp.SetState(scene.robot, scene.X_o, scene.X_o_dot, kappa);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(GrowingGrasp)->Arg(1)->Arg(2)->Arg(4)->Arg(8)->Arg(12)->Unit(benchmark::kMicrosecond);

void CalcLaw(Step* step) {
  const GraspScene& scene = step->scene;
  step->task.CalcAcceleration(scene.q, scene.xi, step->sigma_prime);
  const Vector6d V_Bo_dot =
      CalcTrackingAcceleration(step->gains, OrientationFeedback::kAngles, scene.grasp, step->desired);
  step->law.SetDemand(scene.robot, scene.grasp, V_Bo_dot, step->sigma_prime);
  benchmark::DoNotOptimize(step->law.CalcTorque(scene.grasp, step->F_N).data());
}

void Law(benchmark::State& state, RedundancyWeight::Kind kind) {
  Step step(kind);
  for (auto _ : state) {
    CalcLaw(&step);
    benchmark::ClobberMemory();
  }
}
BENCHMARK_CAPTURE(Law, identity, RedundancyWeight::Kind::kIdentity)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(Law, diagonal, RedundancyWeight::Kind::kDiagonal)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(Law, mass, RedundancyWeight::Kind::kMass)->Unit(benchmark::kMicrosecond);

void Predict(benchmark::State& state) {
  Step step;
  const VectorXd force = VectorXd::Zero(step.scene.robot.size());
  for (auto _ : state) {
    benchmark::DoNotOptimize(step.dynamics.Predict(step.scene.robot, step.scene.grasp, force).f_c.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(Predict)->Unit(benchmark::kMicrosecond);

/// All of it but the choice of F_N.
void ControlStep(benchmark::State& state) {
  Step step;
  GraspScene& scene = step.scene;
  for (auto _ : state) {
    scene.robot.SetState(scene.q, scene.xi);
    scene.robot.CalcDynamics();
    scene.grasp.SetState(scene.robot, scene.X_o, scene.X_o_dot, scene.kappa);
    CalcLaw(&step);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(ControlStep)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dexcheck

BENCHMARK_MAIN();
