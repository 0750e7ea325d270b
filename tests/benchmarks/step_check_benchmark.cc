// The cross-check of one step beside the plant's own step, in one run: compare the ratios, not the times.

#include <benchmark/benchmark.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "harness/engine/clearance.h"
#include "harness/plant/engine_simulation.h"
#include "tests/harness/checks/step_check_scene.h"
#include "tests/harness/run/shipped_run.h"

namespace dexcheck {
namespace {

constexpr int kStates = 16;

/// States of one walk, each with its own controller's terms, so that caches see what a run sees.
struct States {
  States() {
    testing::GraspWalk walk;
    fingertips = walk.scene().fingertips;
    const Torus torus(0.035, 0.011);
    controller.emplace(walk.scene().model.spec(), torus, fingertips);
    for (int i = 0; i < kStates; ++i) {
      walk.Step(1.0);
      q.push_back(walk.q);
      xi.push_back(walk.xi);
      X_Bo.push_back(walk.X_Bo);
      V_Bo.push_back(walk.V_Bo);
    }
  }
  std::vector<int> fingertips;
  std::optional<testing::CheckedController> controller;
  std::vector<VectorXd> q, xi;
  std::vector<Pose> X_Bo;
  std::vector<Vector6d> V_Bo;
};

States& SharedStates() {
  static States states;
  return states;
}

/// mj_step1 and mj_step2 of the scene, from the grasp of its keyframe.
void PlantStep(benchmark::State& state) {
  States& states = SharedStates();
  EngineSimulation plant(states.controller->adapter, /*implicit_damping=*/false);
  const mjModel& model = plant.model();
  const int key = mj_name2id(&model, mjOBJ_KEY, "grasp_ready");
  mj_resetDataKeyframe(&model, &plant.data(), key);
  constexpr int kStepsBeforeItFalls = 20;
  int step = 0;
  for (auto _ : state) {
    if (step++ % kStepsBeforeItFalls == 0) {
      mju_copy(plant.data().qpos, model.key_qpos + key * model.nq, model.nq);
      mju_zero(plant.data().qvel, model.nv);
    }
    plant.BeginStep();
    plant.EndStep();
  }
}
BENCHMARK(PlantStep)->Unit(benchmark::kMicrosecond);

/// The engine's side of the check alone.
void EngineSide(benchmark::State& state) {
  States& states = SharedStates();
  EngineTerms engine(states.controller->adapter, states.fingertips);
  size_t k = 0;
  for (auto _ : state) {
    engine.SetState(states.q[k], states.xi[k], states.X_Bo[k], states.V_Bo[k]);
    benchmark::ClobberMemory();
    k = (k + 1) % kStates;
  }
}
BENCHMARK(EngineSide)->Unit(benchmark::kMicrosecond);

/// The whole check. The model's terms stay those of one state, as if they agreed: what is found costs nothing
/// extra after the first step.
void Compare(benchmark::State& state) {
  States& states = SharedStates();
  testing::CheckedController& controller = *states.controller;
  controller.SetState(states.q[0], states.xi[0], states.X_Bo[0], states.V_Bo[0]);
  double step = 0.0;
  for (auto _ : state) {
    controller.Compare(step += 1.0);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(Compare)->Unit(benchmark::kMicrosecond);

/// Which bodies come near each other, while the robot drives at 1 m/s with the object in its hand and fingers
/// move.
void FollowClearance(benchmark::State& state) {
  const Adapter& adapter = SharedStates().controller->adapter;
  const mjModel& model = adapter.engine();
  const Solids solids = ListSolids(model);
  Clearance clearance(model, adapter, solids, ListWatchedPairs(model, adapter, solids, {}, "benchmark"));
  const MjDataPtr data = MakeData(model);
  const int key = mj_name2id(&model, mjOBJ_KEY, "grasp_ready");
  mju_copy(data->qpos, model.key_qpos + key * model.nq, model.nq);
  const int finger = model.jnt_qposadr[mj_name2id(&model, mjOBJ_JOINT, "rf1_2")];
  constexpr int kPeriod = 1000;
  std::vector<VectorXd> positions, rotations;
  for (int i = 0; i < kPeriod; ++i) {
    data->qpos[0] += 1e-3;
    data->qpos[model.nq - 7] += 1e-3;
    data->qpos[finger] += 1e-4 * std::sin(2.0 * M_PI * i / kPeriod);
    mj_kinematics(&model, data.get());
    positions.emplace_back(Eigen::Map<const VectorXd>(data->xpos, 3 * model.nbody));
    rotations.emplace_back(Eigen::Map<const VectorXd>(data->xmat, 9 * model.nbody));
  }
  int step = 0;
  for (auto _ : state) {
    const auto k = static_cast<size_t>(step % kPeriod);
    clearance.Update({positions[k].data(), rotations[k].data()}, 1e-3 * step++);
  }
  state.counters["measured a step"] = static_cast<double>(clearance.measured()) / step;
}
BENCHMARK(FollowClearance)->Unit(benchmark::kMicrosecond);

/// Follows the clearance along a shipped scenario.
void FollowClearanceOf(benchmark::State& state, const std::string& scenario, const std::string& duration) {
  const testing::ShippedRun shipped(scenario, {"duration=" + duration});
  const Setup& setup = shipped.setup();
  std::vector<VectorXd> positions, rotations;
  Runner runner(setup, /*check=*/false);
  runner.Run(
      [&](const StepRecord& step) {
        positions.push_back(step.reading.body_positions);
        rotations.push_back(step.reading.body_rotations);
      },
      [] { return false; });
  Clearance clearance(setup.engine(), setup.plant_adapter(), setup.robots().solids,
                      setup.robots().watched_pairs);
  int step = 0;
  for (auto _ : state) {
    const auto k = static_cast<size_t>(step) % positions.size();
    clearance.Update({positions[k].data(), rotations[k].data()}, 1e-3 * step++);
  }
  state.counters["measured a step"] = static_cast<double>(clearance.measured()) / step;
  state.counters["steps"] = static_cast<double>(positions.size());
}
BENCHMARK_CAPTURE(FollowClearanceOf, paper, "paper", "2")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(FollowClearanceOf, lift, "lift", "40")->Unit(benchmark::kMicrosecond);

/// The whole robot's terms along a shipped scenario, and with them the forces of all constraints.
void FollowForcesOf(benchmark::State& state, const std::string& scenario, const std::string& duration,
                    bool with_forces) {
  const testing::ShippedRun shipped(scenario, {"duration=" + duration});
  const Setup& setup = shipped.setup();
  std::vector<VectorXd> qpos, qvel;
  std::vector<PlantResponse> responses;
  Runner runner(setup, /*check=*/false);
  runner.Run(
      [&](const StepRecord& step) {
        qpos.push_back(step.reading.qpos);
        qvel.push_back(step.reading.qvel);
        responses.push_back(step.response);
      },
      [] { return false; });
  const ObjectModel& object = setup.declared_object();
  WholeRobot whole(setup.declared_model(), &object.body, setup.plant_adapter());
  ConstraintLaw law(setup.declared_model(), &object, setup.plant_adapter(), whole);
  size_t k = 0, rows = 0;
  for (auto _ : state) {
    k = (k + 1) % qpos.size();
    whole.SetState(qpos[k].data(), qvel[k].data());
    if (!with_forces) continue;
    law.SetStep(qpos[k].data(), qvel[k].data(), responses[k]);
    benchmark::DoNotOptimize(law.FindWorst());
    rows += law.forces().size();
  }
  state.counters["rows"] = benchmark::Counter(static_cast<double>(rows), benchmark::Counter::kAvgIterations);
}
BENCHMARK_CAPTURE(FollowForcesOf, curve_terms, "curve", "0.5", false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(FollowForcesOf, curve_forces, "curve", "0.5", true)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(FollowForcesOf, lift_terms, "lift", "12", false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(FollowForcesOf, lift_forces, "lift", "12", true)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dexcheck

BENCHMARK_MAIN();
