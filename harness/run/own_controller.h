#pragma once

// Controllers of the user's own: shared libraries, Python files and programs.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "controller/control/controller_library.h"
#include "harness/plant/plant.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// A failure of a controller of the user's own, which cannot be used any more.
class ControllerFailure : public RunFailure {
 public:
  using RunFailure::RunFailure;
};

/// Inputs of a controller of the user's own.
struct OwnControllerSetup {
  std::string name;  ///< For messages: "controller law.so".
  const RobotModel* model = nullptr;
  std::vector<int> fingertips;
  MassProperties object;
  const Surface* surface = nullptr;
  GraspControllerOptions options;
  Sampling sampling;
  const JointPlan* joints = nullptr;  ///< Plan of a scenario that moves joints; else null.
  std::string robot_text;             ///< The parameter file, with the changes made to it.
  std::string scenario_text;          ///< The scenario, with the changes made to it.
  OwnControllerOptions own;
};

/// Makes the scenario's own controller, which must be stated.
/// @throws InputError when the scenario has no work for it, when it cannot be loaded or started, is of
/// another version, or does not take a parameter; ControllerFailure when it fails at once.
std::unique_ptr<Controller> MakeOwnController(const Setup& setup, const Sampling& sampling);

/// Returns the file of a controller: a library or a Python file; empty for a command.
std::filesystem::path FindControllerFile(const OwnControllerOptions& own);

/// Returns the hash of that file's bytes; empty for a command.
std::string HashController(const OwnControllerOptions& own);

/// Throws the error of a controller that does not take a parameter. @param why such as "takes no parameters".
[[noreturn]] void RejectParameter(const OwnControllerSetup& setup, const std::string& parameter,
                                  const std::string& why);

/// @throws ControllerFailure, in the name of `who`, unless there are n torques.
void RequireTorques(const std::string& who, const Command& command, Eigen::Index n);

}  // namespace dexcheck
