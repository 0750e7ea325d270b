// The analytic terms beside the engine's own calls, in one run: compare the ratios, not the times.

#include <benchmark/benchmark.h>

#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"
#include "harness/engine/adapter.h"
#include "harness/engine/engine.h"
#include "harness/engine/mujoco_release.h"
#include "harness/engine/velocity_map.h"
#include "tests/common/paths.h"
#include "tests/common/random_robot.h"

namespace dexcheck {
namespace {

constexpr int kStates = 64;
constexpr int kFingertips = 4;

/// The paper's robot in both worlds, with states to cycle through.
struct Robot {
  Robot()
      : model(ReadRobotModel(testing::SourcePath("/controller/parameters/assistant_robot.toml"))),
        engine(LoadMjcf(testing::SourcePath("/mjcf/scene.xml"))),
        adapter(model, *engine, "scene.xml") {
    std::mt19937 random(1);
    VelocityMap map(adapter, Coordinates::kReduced);
    for (int i = 0; i < kStates; ++i) {
      q.push_back(testing::DrawPositions(model, &random));
      xi.push_back(testing::DrawVelocities(model.num_velocities(), &random));
      data.push_back(MakeData(*engine));
      adapter.SetPositions(q.back(), data.back()->qpos);
      map.SetState(q.back(), xi.back());
      map.Expand(xi.back(), data.back()->qvel);
    }
  }
  RobotModel model;
  MjModelPtr engine;
  Adapter adapter;
  std::vector<VectorXd> q;
  std::vector<VectorXd> xi;
  std::vector<MjDataPtr> data;
};

Robot& SharedRobot() {
  static Robot robot;
  return robot;
}

/// M_bar', C_bar' (the matrix), F_bar', and J, J_dot of four fingertips.
void AnalyticTerms(benchmark::State& state) {
  Robot& robot = SharedRobot();
  ModelTerms terms(robot.model);
  Matrix6Xd J[kFingertips];
  Matrix6Xd J_dot[kFingertips];
  for (int i = 0; i < kFingertips; ++i) {
    J[i].setZero(6, terms.size());
    J_dot[i].setZero(6, terms.size());
  }
  size_t k = 0;
  for (auto _ : state) {
    terms.SetState(robot.q[k], robot.xi[k]);
    terms.CalcDynamics();
    for (int i = 0; i < kFingertips; ++i) {
      terms.CalcFrameJacobian(robot.model.fingertips()[static_cast<size_t>(i)], J[i], J_dot[i]);
    }
    benchmark::DoNotOptimize(terms.M().data());
    benchmark::DoNotOptimize(J_dot[0].data());
    benchmark::ClobberMemory();
    k = (k + 1) % kStates;
  }
}
BENCHMARK(AnalyticTerms)->Unit(benchmark::kMicrosecond);

/// Kinematics, and with `dynamics` M_bar', C_bar', F_bar', without the Jacobians.
void AnalyticModel(benchmark::State& state, bool dynamics) {
  Robot& robot = SharedRobot();
  ModelTerms terms(robot.model);
  size_t k = 0;
  for (auto _ : state) {
    terms.SetState(robot.q[k], robot.xi[k]);
    if (dynamics) terms.CalcDynamics();
    benchmark::ClobberMemory();
    k = (k + 1) % kStates;
  }
}
BENCHMARK_CAPTURE(AnalyticModel, Kinematics, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(AnalyticModel, Dynamics, true)->Unit(benchmark::kMicrosecond);

/// The engine's smaller set: M, the bias force, and four Jacobians; no matrix C, no J_dot.
void EngineTermsMujoco(benchmark::State& state) {
  Robot& robot = SharedRobot();
  const mjModel* m = robot.engine.get();
  std::vector<mjtNum> M(static_cast<size_t>(m->nv * m->nv));
  std::vector<mjtNum> bias(static_cast<size_t>(m->nv));
  std::vector<mjtNum> jacp(static_cast<size_t>(3 * m->nv));
  std::vector<mjtNum> jacr(static_cast<size_t>(3 * m->nv));
  size_t k = 0;
  for (auto _ : state) {
    mjData* d = robot.data[k].get();
    mj_kinematics(m, d);
    mj_comPos(m, d);
    MakeMass(*m, d);
    ExpandMass(*m, *d, M.data());
    mj_comVel(m, d);
    mj_rne(m, d, 0, bias.data());
    for (int i = 0; i < kFingertips; ++i) {
      const auto frame = static_cast<size_t>(robot.model.fingertips()[static_cast<size_t>(i)]);
      mj_jacSite(m, d, jacp.data(), jacr.data(), robot.adapter.frame_sites()[frame]);
    }
    benchmark::ClobberMemory();
    k = (k + 1) % kStates;
  }
}
BENCHMARK(EngineTermsMujoco)->Unit(benchmark::kMicrosecond);

/// Chains (branching 0) and trees of growing size. Cost should grow with joints times depth.
void GrowingTree(benchmark::State& state) {
  std::mt19937 random(7);
  testing::RandomRobotOptions options;
  options.joints = static_cast<int>(state.range(0));
  options.branching = state.range(1) == 0 ? 0.0 : 0.5;
  options.base = BaseType::kFixed;
  const RobotModel model(testing::MakeRandomRobot(options, &random));
  ModelTerms terms(model);
  const VectorXd q = testing::DrawPositions(model, &random);
  const VectorXd xi = testing::DrawVelocities(terms.size(), &random);
  double pairs = 0.0;
  for (int i = 0; i < model.num_joints(); ++i) pairs += model.depth(i);
  for (auto _ : state) {
    terms.SetState(q, xi);
    terms.CalcDynamics();
    benchmark::ClobberMemory();
  }
  state.counters["depth"] = model.max_depth();
  state.counters["pairs"] = pairs;
  state.counters["per_pair"] =
      benchmark::Counter(pairs, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(GrowingTree)
    ->ArgNames({"joints", "branching"})
    ->ArgsProduct({{10, 20, 50, 100, 200}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dexcheck

BENCHMARK_MAIN();
