#include "harness/run/own_controller.h"

#include <string_view>

#include "harness/plant/plant.h"
#include "harness/run/library_controller.h"
#include "harness/run/program_controller.h"

namespace dexcheck {

std::unique_ptr<Controller> MakeOwnController(const std::string& what, const OwnControllerSetup& setup) {
  if (std::string_view(what).ends_with(".so")) return std::make_unique<LibraryController>(what, setup);
  return std::make_unique<ProgramController>(what, setup);
}

void RequireTorques(const std::string& who, const Command& command, Eigen::Index n) {
  if (command.tau.size() != n) {
    throw RunFailure(who + ": sent " + std::to_string(command.tau.size()) + " torques, must be " +
                     std::to_string(n));
  }
  if (!command.tau.allFinite()) throw RunFailure(who + ": sent a torque that is not a number");
}

}  // namespace dexcheck
