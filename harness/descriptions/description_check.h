#pragma once

// The constants of a description that are no part of the terms: coupled joints.

#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "harness/gate/static_gate.h"

namespace dexcheck {

/// Compares couplings of joints with those of the engine's model, in the place of the gate's findings that
/// the engine has them.
/// @param ignores_couplings none is a disagreement. @return notes on what one side lacks, and is not
/// compared.
std::vector<std::string> CheckDescription(const RobotDescription& robot, const Adapter& adapter,
                                          GateResult* gate, bool ignores_couplings = false);

}  // namespace dexcheck
