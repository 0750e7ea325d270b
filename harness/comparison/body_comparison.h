#pragma once

// Mass centres and inertias of two descriptions, number by number, as their files print them.

#include <array>
#include <string>
#include <vector>

#include "harness/comparison/constant_checks.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Compares the centre of mass (check "link_com": x, y, z, m) and the inertia about it (check "link_inertia":
/// xx, yy, zz, xy, xz, yz, kg m^2) of each link that has mass in both descriptions. All numbers are expressed
/// in the link's own frame of `a`. Centres are relative to their distance from the link's origin or to the
/// link's radius of gyration, whichever is larger; inertias are relative to the largest moment. Locations are
/// those of `a`.
/// @param X_ab frames of `b` in those of `a`; none: the two files have the same.
ConstantChecks CompareBodies(const RobotDescription& a, const RobotDescription& b,
                             const std::vector<Pose>& X_ab = {});

/// Names what the compiler changed: in a note, at findings of masses, and by findings of inertias where the
/// other description has what the text states.
/// @param robots both descriptions, with joints of the same names. @param side of the MJCF: 0 or 1.
void NameCompiledChanges(const std::vector<CompiledChange>& changes,
                         const std::array<const RobotDescription*, 2>& robots, size_t side,
                         ConstantChecks* constants, std::vector<std::string>* notes);

}  // namespace dexcheck
