#pragma once

// The parts of the loop that a scenario names.

#include <functional>
#include <memory>
#include <vector>

#include "controller/control/controller.h"
#include "controller/control/trajectory_controller.h"
#include "controller/handling/pick_and_place_controller.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/plant/imperfections.h"
#include "harness/plant/plant.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Plant, controller and the parts between them. Any may be exchanged, or wrapped, before a loop is made.
struct LoopParts {
  std::unique_ptr<Plant> plant;
  std::unique_ptr<Controller> controller;
  const PickAndPlaceController* task = nullptr;    ///< The controller, when it does a task.
  const TrajectoryController* follower = nullptr;  ///< The controller, when it follows its contacts by (40).
  bool knows_law = true;                           ///< Whether the controller's law is the scenario's.
  SearchOptions search;                            ///< Options of the search for causes of failed checks.
  SensingOptions sensing;
  ActuationOptions actuation;
  std::vector<DisturbanceOptions> disturbances;
  /// Changes the measured state at time t in a way that no scenario declares; empty for no change.
  std::function<void(double t, MeasuredState* measured)> hidden_sensor_fault;
};

/// Makes the parts that the scenario names, with robot and object where it starts.
/// A controller of the user's own has the scenario's law when the scenario names one.
/// @throws InputError as EnginePlant and MakeOwnController; the errors of the controllers' constructors.
LoopParts MakeLoopParts(const Setup& setup);

/// Makes the controller of the scenario's law or task, also where a user's own replaces it.
std::unique_ptr<Controller> MakeScenarioLaw(const Setup& setup);

}  // namespace dexcheck
