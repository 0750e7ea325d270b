#pragma once

// Controllers that the user brings along: shared libraries, Python files and programs.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "controller/control/controller_library.h"
#include "harness/plant/plant.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// A controller of the user's own failed; of no use any more.
class ControllerFailure : public RunFailure {
 public:
  using RunFailure::RunFailure;
};

/// What a controller of one's own is given.
struct OwnControllerSetup {
  std::string name;  ///< For messages: "controller law.so".
  const RobotModel* model = nullptr;
  std::vector<int> fingertips;
  MassProperties object;
  const Surface* surface = nullptr;
  GraspControllerOptions options;
  Sampling sampling;
  const JointPlan* joints = nullptr;  ///< Of a scenario that moves joints.
  std::string robot_text;             ///< The parameter file, with what is changed in it.
  std::string scenario_text;          ///< The scenario, likewise.
  OwnControllerOptions own;
};

/// The scenario's own controller, which exists.
/// @throws InputError when the scenario has none for it to do, when it cannot be loaded or started, is of
/// another version, or does not take a parameter; ControllerFailure when it fails at once.
std::unique_ptr<Controller> MakeOwnController(const Setup& setup, const Sampling& sampling);

/// The file that a controller is: a library or a Python file; empty for a command.
std::filesystem::path FindControllerFile(const OwnControllerOptions& own);

/// Of that file's bytes; empty for a command.
std::string HashController(const OwnControllerOptions& own);

/// The error of a controller that does not take a parameter. @param why such as "takes no parameters".
[[noreturn]] void RejectParameter(const OwnControllerSetup& setup, const std::string& parameter,
                                  const std::string& why);

/// @throws ControllerFailure, in the name of `who`, unless there are n torques.
void RequireTorques(const std::string& who, const Command& command, Eigen::Index n);

}  // namespace dexcheck
