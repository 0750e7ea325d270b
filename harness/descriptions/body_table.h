#pragma once

// A table of bodies as CAD programs export it: masses, centres of mass and inertias of links, no joints.

#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// A row of a table of bodies.
struct TabledBody {
  std::string link;
  MassProperties body;  ///< In the link's own frame.
  int line = 0;
};

/// Reads lines of values between commas or semicolons under a header of "link", "mass [g]", "com_x [mm]",
/// "com_y", "com_z", "ixx [g*mm^2]", "iyy", "izz", "ixy", "ixz", "iyz". A column without a unit has that of
/// the column before of its kind, or is in SI. Inertias are about the centre of mass, unless a line before
/// says "# inertia: origin".
/// @throws InputError "SOURCE:LINE: ..." for what is missing or no number.
std::vector<TabledBody> ReadBodyTable(const std::string& text, const std::string& source);

/// The other description's robot with these bodies in the place of its links' own.
/// @throws InputError when it has none of the links.
RobotDescription PlaceBodies(const std::vector<TabledBody>& bodies, const std::string& source,
                             const RobotDescription& other);

}  // namespace dexcheck
