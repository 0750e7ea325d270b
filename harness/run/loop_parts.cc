#include "harness/run/loop_parts.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/control/joint_controller.h"
#include "harness/plant/engine_plant.h"
#include "harness/plant/rigid_plant.h"
#include "harness/run/own_controller.h"

namespace dexcheck {
namespace {

/// The least mu between a fingertip of the grasp and the object.
double FindFingerFriction(const Setup& setup) {
  const mjModel& m = setup.engine();
  const int object = setup.adapter().object_body();
  double mu = std::numeric_limits<double>::infinity();
  for (const int tip : setup.fingertips()) {
    const int body = m.site_bodyid[setup.adapter().frame_sites()[static_cast<size_t>(tip)]];
    for (int pair = 0; pair < m.npair; ++pair) {
      const int first = m.geom_bodyid[m.pair_geom1[pair]];
      const int second = m.geom_bodyid[m.pair_geom2[pair]];
      if ((first == body && second == object) || (first == object && second == body)) {
        mu = std::min(mu, m.pair_friction[5 * pair]);
      }
    }
  }
  return mu;
}

std::unique_ptr<Plant> MakeRigidPlant(const Setup& setup) {
  const PlantOptions& options = setup.scenario().plant;
  for (const Joint& joint : setup.robots().rigid->joints()) {
    if (joint.dry_friction > 0.0)
      throw InputError(setup.scenario().source + ": plant.type: a rigid plant has no dry friction, joint " +
                       Quote(joint.name) + " has some");
  }
  const EngineSimulation engine(setup.adapter(), /*implicit_damping=*/false);
  auto plant = std::make_unique<RigidPlant>(
      *setup.robots().rigid, setup.adapter(), setup.fingertips(), engine.ListMotors(),
      RigidPlantOptions{options.time_step, options.integrator, FindFingerFriction(setup)});
  plant->Place(setup.start().q, setup.start().X_Bo);
  return plant;
}

std::unique_ptr<Plant> MakePlant(const Setup& setup) {
  if (setup.scenario().plant.type == PlantType::kRigid) return MakeRigidPlant(setup);
  auto plant = std::make_unique<EnginePlant>(setup.adapter(), setup.fingertips(), setup.surface(),
                                             setup.scenario().plant.implicit_damping);
  if (LetsBodiesPush(setup.scenario().plant, setup.engine()))
    plant->WatchCollisions(ListPushingGeoms(setup.robots()));
  if (!setup.start().bonds.empty()) plant->SetBonds(setup.start().kappa, setup.start().bond_constraints);
  plant->SetFeet(setup.feet());
  plant->Place(setup.start().q, setup.start().X_Bo);
  return plant;
}

/// The controller of the scenario's task.
void MakeBuiltInController(const Setup& setup, LoopParts* parts) {
  const Scenario& scenario = setup.scenario();
  const RobotModel& model = setup.model();
  const MassProperties& object = setup.object().body;
  if (const PickTask* const pick = scenario.pick_task()) {
    auto task = std::make_unique<PickAndPlaceController>(model, setup.hold().hand, object, setup.surface(),
                                                         setup.MakeControllerOptions(), setup.start().q,
                                                         pick->pick_and_place, scenario.plant.time_step);
    parts->task = task.get();
    parts->controller = std::move(task);
  } else if (const JointPlan* const joints = setup.joints()) {
    parts->controller =
        std::make_unique<JointController>(model, object, setup.surface(), scenario.control.law, joints->gains,
                                          joints->motion, setup.MakeSampling());
  } else {
    auto controller =
        std::make_unique<TrajectoryController>(model, setup.fingertips(), object, setup.surface(),
                                               setup.MakeControllerOptions(), setup.MakeSampling());
    if (scenario.control.kappa == ContactSource::kIntegrated) parts->follower = controller.get();
    parts->controller = std::move(controller);
  }
}

}  // namespace

std::unique_ptr<Controller> MakeScenarioLaw(const Setup& setup) {
  LoopParts parts;
  MakeBuiltInController(setup, &parts);
  return std::move(parts.controller);
}

LoopParts MakeLoopParts(const Setup& setup) {
  LoopParts parts;
  parts.plant = MakePlant(setup);
  if (setup.scenario().controller.exists()) {
    parts.controller = MakeOwnController(setup, setup.MakeSampling());
    parts.knows_law = setup.scenario().knows_law();
  } else {
    MakeBuiltInController(setup, &parts);
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
