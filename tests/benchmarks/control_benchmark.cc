// Time of one control step of the paper's robot with four contacts, and of its parts.

#include <benchmark/benchmark.h>

#include "controller/control/computed_torque.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/control/grasp_terms.h"
#include "tests/common/paper_robot.h"
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

/// The paper's robot with six fingers a hand: copies of two, aside of them.
RobotModel MakeTwelveFingers() {
  RobotSpec spec = testing::ReadPaperRobot(DriveVelocity::kTwist).spec();
  const RobotModel eight(spec);
  constexpr double kAside = 0.02;  // m
  for (const int original : {0, 1, 4, 5}) {
    Frame tip = spec.frames[static_cast<size_t>(eight.fingertips()[static_cast<size_t>(original)])];
    std::vector<int> chain;
    for (int i = tip.link; chain.size() < 4; i = spec.joints[static_cast<size_t>(i)].parent)
      chain.insert(chain.begin(), i);
    int parent = spec.joints[static_cast<size_t>(chain.front())].parent;
    for (const int i : chain) {
      Joint joint = spec.joints[static_cast<size_t>(i)];
      joint.name += "_more";
      joint.link += "_more";
      joint.parent = parent;
      if (i == chain.front()) joint.X_PB.translation().y() += kAside;
      parent = static_cast<int>(spec.joints.size());
      spec.joints.push_back(joint);
    }
    tip.name += "_more";
    tip.link = parent;
    spec.frames.push_back(tip);
  }
  return RobotModel(spec);
}

/// A grasp of as many contacts as fingertips, on a robot of twelve: places on the torus for the time that
/// they take, not for a grasp that could be.
struct Growing {
  explicit Growing(size_t count)
      : model(MakeTwelveFingers()),
        surface(0.035, 0.011),
        fingertips(model.fingertips().begin(),
                   model.fingertips().begin() + static_cast<std::ptrdiff_t>(count)),
        robot(model),
        grasp(model, fingertips, model.object()->body, surface),
        law(model, static_cast<int>(count)),
        dynamics(model, static_cast<int>(count)),
        force(VectorXd::Zero(model.num_velocities())) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    VectorXd q(model.num_positions()), xi(model.num_velocities());
    for (VectorXd* vector : {&q, &xi}) {
      for (double& entry : *vector) entry = uniform(random);
    }
    X_o << 0.3, 0.2, 0.9, 0.1, 1.2, 0.3;
    for (double& rate : X_o_dot) rate = uniform(random);
    for (size_t i = 0; i < count; ++i)
      kappa.push_back(
          {{uniform(random), uniform(random), 0}, {6.0 * uniform(random), uniform(random), 0}, 0.2});
    robot.SetState(q, xi);
    robot.CalcDynamics();
    SetGrasp();
  }
  void SetGrasp() { grasp.SetState(robot, X_o, X_o_dot, kappa); }

  RobotModel model;
  Torus surface;
  std::vector<int> fingertips;
  ModelTerms robot;
  GraspTerms grasp;
  ComputedTorque law;
  ConstrainedDynamics dynamics;
  VectorXd force;
  Vector6d X_o, X_o_dot;
  std::vector<ContactCoordinates> kappa;
};

void GrowingTerms(benchmark::State& state) {
  Growing growing(static_cast<size_t>(state.range(0)));
  for (auto _ : state) {
    growing.SetGrasp();
    benchmark::ClobberMemory();
  }
}
BENCHMARK(GrowingTerms)->DenseRange(1, 4)->Arg(6)->Arg(8)->Arg(10)->Arg(12)->Unit(benchmark::kMicrosecond);

/// (47) and the torques without contact forces, which any number of contacts has.
void GrowingLaw(benchmark::State& state) {
  Growing growing(static_cast<size_t>(state.range(0)));
  for (auto _ : state) {
    growing.law.SetMotion(growing.robot, growing.grasp, growing.X_o_dot, growing.force);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(GrowingLaw)->DenseRange(1, 4)->Arg(6)->Arg(8)->Arg(10)->Arg(12)->Unit(benchmark::kMicrosecond);

void GrowingPrediction(benchmark::State& state) {
  Growing growing(static_cast<size_t>(state.range(0)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        growing.dynamics.Predict(growing.robot, growing.grasp, growing.force).f_c.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(GrowingPrediction)
    ->DenseRange(1, 4)
    ->Arg(6)
    ->Arg(8)
    ->Arg(10)
    ->Arg(12)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dexcheck

BENCHMARK_MAIN();
