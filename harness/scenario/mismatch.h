#pragma once

#include <cstdint>
#include <string>

#include "controller/model/robot_model.h"
#include "harness/engine/adapter.h"
#include "harness/plant/imperfections.h"

namespace dexcheck {

/// Changes the engine's robot, and says of the change what the checks have to know: `plant` becomes what the
/// engine's robot is now. The controller's model stays as it is.
/// @param adapter of the controller's model and `engine`, which is changed. @param seed draws what is random.
/// @param source the scenario's file, for messages.
/// @throws InputError when a link or joint is not there.
void ApplyMismatch(const MismatchOptions& options, std::uint64_t seed, const std::string& source,
                   const Adapter& adapter, mjModel* engine, RobotSpec* plant);

}  // namespace dexcheck
