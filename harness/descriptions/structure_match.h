#pragma once

// Which joint of one file is which of another that calls them otherwise: by the tree, and then by numbers.

#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Joint of `b` for each of `a`, such that kinds of joints and what hangs on what are the same. A name that
/// both have is one joint. Of several such matches, the one whose axes and places at zero, masses and ranges
/// differ least. Empty where there is none, or more than 12 joints hang on one link.
std::vector<int> MatchByStructure(const RobotDescription& a, const RobotDescription& b);

}  // namespace dexcheck
