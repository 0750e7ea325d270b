#pragma once

// Controllers that the user brings along: a shared library or a program.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "controller/control/controller_library.h"
#include "harness/scenario/start_state.h"

namespace dexcheck {

/// What a controller of one's own is given.
struct OwnControllerSetup {
  const RobotModel* model = nullptr;
  std::vector<int> fingertips;
  MassProperties object;
  const Surface* surface = nullptr;
  GraspControllerOptions options;
  Sampling sampling;
  const JointPlan* joints = nullptr;  ///< Of a scenario that moves joints.
  std::string robot_text;             ///< The parameter file.
  std::string scenario_text;          ///< The scenario.
  double time_limit = 1.0;            ///< For each answer, s; ten times that to start.
};

/// @param what a shared library (a name that ends in .so), or else a command for the shell.
/// @throws as LibraryController and ProgramController.
std::unique_ptr<Controller> MakeOwnController(const std::string& what, const OwnControllerSetup& setup);

/// @throws RunFailure, in the name of `who`, unless there are n torques.
void RequireTorques(const std::string& who, const Command& command, Eigen::Index n);

}  // namespace dexcheck
