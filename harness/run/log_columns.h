#pragma once

// Names and units of the columns of a run's log.

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "controller/model/robot_model.h"

namespace dexcheck {

struct LogColumns {
  std::vector<std::string> names;
  std::string units;  ///< One for each column, separated by ", "; one alone when all have it.
};

/// Columns of qpos: "JOINT", and of free joints "JOINT.x" to "JOINT.z" and "JOINT.qw" to "JOINT.qz".
LogColumns ListPositionColumns(const mjModel& model);
/// Columns of qvel: "JOINT", "JOINT.v_x" to "JOINT.v_z" (world) and "JOINT.w_x" to "JOINT.w_z" (body).
LogColumns ListVelocityColumns(const mjModel& model);

/// Units of quantities of the base's coordinates followed by the joints'.
/// @param base of the base's coordinates. @param per "" for positions, "/s" for velocities, "/s^2" for
/// accelerations.
std::string ListJointUnits(const RobotModel& model, const std::vector<std::string>& base, const char* per);

}  // namespace dexcheck
