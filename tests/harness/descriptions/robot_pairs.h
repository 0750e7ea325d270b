#pragma once

// Robots that are described twice: as the description that may be wrong, and as it should be.

#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"

namespace dexcheck::testing {

struct RobotPair {
  std::string name;
  RobotDescription a;  ///< By URDF.
  RobotDescription b;  ///< By MJCF.
};

/// The Panda, a humanoid whose pelvis floats, and two random robots, one of which floats.
const std::vector<RobotPair>& ListRobotPairs();

}  // namespace dexcheck::testing
