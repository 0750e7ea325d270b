#pragma once

// The shipped parameter files, as the tests read them.

#include "controller/model/parameter_reader.h"
#include "tests/common/paths.h"

namespace dexcheck::testing {

/// The paper's robot with the given choice of v (12).
inline RobotModel ReadPaperRobot(DriveVelocity velocity = DriveVelocity::kTwist) {
  RobotSpec spec = ReadRobotModel(SourcePath("/controller/parameters/assistant_robot.toml")).spec();
  spec.base.velocity = velocity;
  return RobotModel(spec);
}

inline RobotModel ReadPanda() { return ReadRobotModel(SourcePath("/controller/parameters/panda.toml")); }

}  // namespace dexcheck::testing
