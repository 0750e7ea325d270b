#pragma once

#include "controller/common/toml_reader.h"
#include "harness/scenario/scenario.h"

namespace dexcheck {

/// Reads [joint_motion], a motion of the joints of a robot that holds nothing.
/// @throws InputError as TomlValue. Names of joints are looked up where the robot is known.
JointMotionOptions ReadJointMotion(const TomlValue& value);

/// Reads [control] of such a robot: the law, and gains by joint. @throws InputError as TomlValue.
void ReadJointControl(const TomlValue& value, Scenario* scenario);

/// @throws InputError when the rest of the scenario does not fit a motion of joints.
void RequireJointMotion(const Scenario& scenario);

}  // namespace dexcheck
