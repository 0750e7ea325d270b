#pragma once

#include <string>
#include <vector>

#include "controller/model/robot_model.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck::cli {

/// Changes what the engine refuses of a description that an MJCF is made of, and warns of it: ranges without
/// width, inertias that no body has, of which the nearest stand, links that move and have no mass.
void MendForEngine(RobotDescription* robot);

/// Joints that follow others no longer do, since each has a motor of its own in a run; warns of it.
void FreeCoupledJoints(RobotDescription* robot);

/// Of each joint while all else is free, at zero: kg m^2 or kg.
VectorXd CalcJointInertias(const RobotModel& model);

/// Friction that stops a joint within less than 10 ms, which leaves its law no time to act and no delay that
/// it stands, is reduced to what does so in that time; dry friction from 1 rad/s or 1 m/s.
/// @returns the joints of which it warns.
std::vector<Joint> ReduceFriction(const std::string& source, RobotDescription* robot);

}  // namespace dexcheck::cli
