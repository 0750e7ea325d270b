#pragma once

// The constants of a description for which the analytic model has no place: dry friction, coupled joints.

#include <string>
#include <vector>

#include "harness/gate/static_gate.h"
#include "harness/sides/robot_description.h"

namespace dexcheck {

/// Compares dry friction and couplings of joints with those of the engine's model, in the place of the gate's
/// findings that the engine has them.
/// @return notes on what one side lacks, and is not compared.
std::vector<std::string> CheckDescription(const RobotDescription& robot, const Adapter& adapter,
                                          GateResult* gate);

}  // namespace dexcheck
