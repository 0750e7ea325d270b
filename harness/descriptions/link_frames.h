#pragma once

// Where the links of two descriptions are in each other, and a frame on each link that has no common one.

#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// A link of two descriptions: which frame it has is each description's own choice.
struct LinkPlace {
  int a = -1;  ///< Its joint in `a`; -1 the base.
  int b = -1;
  Pose X_ab = Pose::Identity();  ///< Frame i of `b` in that of `a`: they coincide so with all joints at zero.
};

/// The joints' links and a floating base, as far as `b` has parts of them.
/// @param a, b as CompleteEachOther left them; without places when their joints do not match.
std::vector<LinkPlace> PlaceLinks(const RobotDescription& a, const RobotDescription& b);

/// Adds to both descriptions a frame of the link's name on each link that joints move and on which they have
/// none in common, so that how links move is compared: the link's own frame of `b`, and in `a` where it is
/// with all joints at zero. @return whether there is such a link.
bool AddLinkFrames(RobotDescription* a, RobotDescription* b);

}  // namespace dexcheck
