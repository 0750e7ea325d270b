#include "harness/run/loop_parts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "controller/control/trajectory_controller.h"
#include "harness/plant/engine_plant.h"

namespace dexcheck {
namespace {

std::unique_ptr<Plant> MakePlant(const Setup& setup) {
  auto plant = std::make_unique<EnginePlant>(setup.adapter(), setup.fingertips(), setup.surface(),
                                             setup.scenario().plant.implicit_damping);
  if (!setup.bonds().empty()) plant->SetBonds(setup.kappa_start(), setup.bond_constraints());
  plant->Place(setup.q_start(), setup.X_Bo_start());
  return plant;
}

std::unique_ptr<Controller> MakeTrajectoryController(const Setup& setup) {
  const PlantOptions& plant = setup.scenario().plant;
  const Sampling sampling = {.time_step = plant.time_step,
                             .hold = std::max(1L, std::lround(plant.control_step / plant.time_step))};
  return std::make_unique<TrajectoryController>(setup.model(), setup.fingertips(), setup.object().body,
                                                setup.surface(), setup.MakeControllerOptions(), sampling);
}

std::unique_ptr<PickAndPlaceController> MakeTaskController(const Setup& setup) {
  const Scenario& scenario = setup.scenario();
  return std::make_unique<PickAndPlaceController>(
      setup.model(), setup.hand(), setup.object().body, setup.surface(), setup.MakeControllerOptions(),
      setup.q_start(), scenario.task->pick_and_place, scenario.plant.time_step);
}

}  // namespace

LoopParts MakeLoopParts(const Setup& setup) {
  LoopParts parts;
  parts.plant = MakePlant(setup);
  if (setup.scenario().task) {
    std::unique_ptr<PickAndPlaceController> task = MakeTaskController(setup);
    parts.task = task.get();
    parts.controller = std::move(task);
  } else {
    parts.controller = MakeTrajectoryController(setup);
  }
  const Imperfections& imperfections = setup.scenario().imperfections;
  parts.sensing = imperfections.sensing;
  parts.actuation = imperfections.actuation;
  parts.disturbances = imperfections.disturbances;
  // A fault to be found: the checks do not know of it.
  parts.sensing.contact_error = setup.scenario().control.contact_error;
  return parts;
}

}  // namespace dexcheck
