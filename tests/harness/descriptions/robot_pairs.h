#pragma once

// Robots that are described twice: as the description that may be wrong, and as it should be.

#include <string>
#include <vector>

#include "harness/descriptions/robot_description.h"
#include "tests/common/convention_faults.h"

namespace dexcheck::testing {

struct RobotPair {
  std::string name;
  RobotDescription a;  ///< By URDF.
  RobotDescription b;  ///< By MJCF.
};

/// The Panda, a humanoid whose pelvis floats, and two random robots, one of which floats.
const std::vector<RobotPair>& ListRobotPairs();

/// Makes the fault at one joint and its link. @return whether the description has changed by it.
bool SpoilLink(const ConventionFault& fault, size_t i, RobotDescription* robot);

}  // namespace dexcheck::testing
