#pragma once

#include <string>

#include "harness/descriptions/robot_description.h"

namespace dexcheck::cli {

/// Changes what the engine refuses or a run cannot follow, of a description that an MJCF is made of, and
/// warns of it: ranges without width, inertias that no body has, links that move and have no mass, and
/// friction that stops a joint within the time step. @param source its file, for messages.
void MendForRun(const std::string& source, RobotDescription* robot);

}  // namespace dexcheck::cli
