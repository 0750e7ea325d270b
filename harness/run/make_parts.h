#pragma once

// Plant and controller of a scenario.

#include <memory>

#include "controller/control/controller.h"
#include "controller/handling/pick_and_place_controller.h"
#include "harness/plant/plant.h"
#include "harness/simulation/setup.h"

namespace dexcheck {

/// The scenario's plant, with robot and object where the scenario starts. @throws InputError as EnginePlant.
std::unique_ptr<Plant> MakePlant(const Setup& setup);

/// The law (55) along a trajectory that the loop chooses. @throws as TrajectoryController.
std::unique_ptr<Controller> MakeTrajectoryController(const Setup& setup);

/// The scenario's task. @throws as PickAndPlaceController.
std::unique_ptr<PickAndPlaceController> MakeTaskController(const Setup& setup);

}  // namespace dexcheck
