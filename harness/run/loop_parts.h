#pragma once

// What a scenario puts into the loop.

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "controller/control/controller.h"
#include "controller/control/trajectory_controller.h"
#include "controller/handling/pick_and_place_controller.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/plant/imperfections.h"
#include "harness/plant/plant.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Plant, controller and what stands between them. Any of them may be exchanged, or wrapped, before a loop is
/// made of them.
struct LoopParts {
  std::unique_ptr<Plant> plant;
  std::unique_ptr<Controller> controller;
  const PickAndPlaceController* task = nullptr;    ///< The controller, when it does a task.
  const TrajectoryController* follower = nullptr;  ///< The controller, when it follows its contacts by (40).
  bool knows_law = true;                           ///< Whether the controller's law is the scenario's.
  int threads = 1;                                 ///< 2: checks have a thread of their own.
  SearchOptions search;                            ///< Of what explains a run whose checks fail.
  SensingOptions sensing;
  ActuationOptions actuation;
  std::vector<DisturbanceOptions> disturbances;
  /// Changes the measured state at time t besides, as no scenario declares; empty for nothing.
  std::function<void(double t, MeasuredState* measured)> hidden_sensor_fault;
};

/// The parts that the scenario names, robot and object where it starts.
/// A controller of the user's own has the scenario's law when the scenario names one.
/// @throws InputError as EnginePlant and MakeOwnController; what the controllers' constructors throw.
LoopParts MakeLoopParts(const Setup& setup);

/// The controller of the scenario's law or task, also where a user's own takes its place.
std::unique_ptr<Controller> MakeScenarioLaw(const Setup& setup);

}  // namespace dexcheck
