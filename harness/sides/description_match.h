#pragma once

// Two descriptions of one robot are brought to the same statements.

#include <string>
#include <vector>

#include "harness/sides/robot_description.h"

namespace dexcheck {

/// Index in `b` of each joint of `a`, by name; -1 where there is none.
std::vector<int> MatchJoints(const RobotSpec& a, const RobotSpec& b);

/// Gives the joints of `b` the names of `a` when they are alike, and completes either description by what
/// only the other one states: gravity, constants of joints, names of links whose joints have one name; frames
/// that only one has are dropped.
/// @return notes on what is not compared, and why.
/// @throws InputError that lists the joints that one lacks, or names one whose kind or parent differs.
std::vector<std::string> CompleteEachOther(RobotDescription* a, RobotDescription* b);

}  // namespace dexcheck
