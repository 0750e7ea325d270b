#pragma once

// The constants of a description that are no part of the terms: coupled joints.

#include <string>
#include <vector>

#include "harness/descriptions/constant_checks.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Compares couplings of joints with those of the engine's model, in the place of the constant checks'
/// findings that the engine has them.
/// @param ignores_couplings none is a disagreement. @return notes on what one side lacks, and is not
/// compared.
std::vector<std::string> CheckDescription(const RobotDescription& robot, const Adapter& adapter,
                                          ConstantChecks* constants, bool ignores_couplings = false);

}  // namespace dexcheck
