#pragma once

// Two analytic models of one robot, from two descriptions, at random states.

#include <functional>

#include "harness/checks/consistency.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Constants that both state, then the robot's terms at random states over the ranges of `a`. `model_value`
/// of a record is that of `a`, `engine_value` that of `b`; locations are those of `a`.
/// @param a, b as CompleteEachOther left them.
ConsistencyResult CompareDescriptions(const RobotDescription& a, const RobotDescription& b,
                                      const ConsistencyOptions& options,
                                      const std::function<bool(long)>& progress);

}  // namespace dexcheck
