#pragma once

// Controllers of the user's own: shared libraries, Python files and programs.

#include <filesystem>
#include <memory>
#include <string>

#include "controller/control/controller.h"
#include "harness/plant/plant.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// A failure of a controller of the user's own, which cannot be used any more.
class ControllerFailure : public RunFailure {
 public:
  using RunFailure::RunFailure;
};

/// Makes the scenario's own controller, which must be stated.
/// @throws InputError when the scenario has no work for it, when it cannot be loaded or started, is of
/// another version, or does not take a parameter; ControllerFailure when it fails at once.
std::unique_ptr<Controller> MakeOwnController(const Setup& setup, const Sampling& sampling);

/// Returns the file of a controller: a library or a Python file; empty for a command.
std::filesystem::path FindControllerFile(const OwnControllerOptions& own);

/// Returns the hash of that file's bytes; empty for a command.
std::string HashController(const OwnControllerOptions& own);

}  // namespace dexcheck
