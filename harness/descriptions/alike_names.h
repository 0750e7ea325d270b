#pragma once

// Which joint of one file is which of another: by similar names ("panda_joint1" and "joint1",
// "LeftKnee" and "left_knee"), or by the tree, and then by numbers.

#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Its letters and digits, in small letters.
std::string SimplifyName(const std::string& name);

/// The name in `others` of each name: the same but for what all names of one file begin or end with, capitals
/// and punctuation. Empty unless each name has one partner of its own.
std::vector<std::string> FindAlikeNames(const std::vector<std::string>& names,
                                        const std::vector<std::string>& others);

std::vector<std::string> ListJointNames(const RobotDescription& robot);

/// Gives the joints of a description the names that another file has for them, when those are similar, or
/// else when one tree is the other's (MatchByStructure). @return a note that lists them; none when nothing
/// was renamed.
std::vector<std::string> TakeJointNames(const RobotDescription& other, RobotDescription* robot);

/// Joint of `b` for each of `a`, such that kinds of joints and what hangs on what are the same. A name that
/// both have is one joint. Of several such matches, the one whose axes and places at zero, masses and ranges
/// differ least. Empty where there is none, or more than 12 joints hang on one link.
std::vector<int> MatchByStructure(const RobotDescription& a, const RobotDescription& b);

}  // namespace dexcheck
