#pragma once

// What a scenario puts into the loop.

#include <memory>
#include <vector>

#include "controller/control/controller.h"
#include "controller/handling/pick_and_place_controller.h"
#include "harness/plant/plant.h"
#include "harness/plant/imperfections.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Plant, controller and what stands between them. Any of them may be exchanged, or wrapped, before a loop is
/// made of them.
struct LoopParts {
  std::unique_ptr<Plant> plant;
  std::unique_ptr<Controller> controller;
  const PickAndPlaceController* task = nullptr;  ///< The controller, when it does a task.
  SensingOptions sensing;
  ActuationOptions actuation;
  std::vector<DisturbanceOptions> disturbances;
};

/// The parts that the scenario names, robot and object where it starts.
/// @throws InputError as EnginePlant; what the controllers' constructors throw.
LoopParts MakeLoopParts(const Setup& setup);

}  // namespace dexcheck
