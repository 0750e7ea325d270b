#pragma once

// Mass centres and inertias of two descriptions, number by number, as their files print them.

#include <vector>

#include "harness/descriptions/constant_checks.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Returns the pose of each link's own frame of `b` in that of `a`, by the joints of `a`. It is the identity
/// where the link has the same body in both files, so that an error of a joint that carries the link does not
/// count for the link. Elsewhere it is where the frames stand with all joints at zero.
/// @param a, b as CompleteEachOther left them.
std::vector<Pose> RegisterLinks(const RobotDescription& a, const RobotDescription& b);

/// Compares the centre of mass (check "link_com": x, y, z, m) and the inertia about it (check "link_inertia":
/// xx, yy, zz, xy, xz, yz, kg m^2) of each link that has mass in both descriptions. All numbers are expressed
/// in the link's own frame of `a`. Where the two files place a link differently but give it the same body,
/// the body agrees. Centres are relative to their distance from the link's origin or to the link's radius of
/// gyration, whichever is larger; inertias are relative to the largest moment.
/// @param a, b as CompleteEachOther left them. Locations are those of `a`.
ConstantChecks CompareBodies(const RobotDescription& a, const RobotDescription& b);

}  // namespace dexcheck
