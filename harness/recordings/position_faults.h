#pragma once

// Positions and torques of a recording that are not the model's: another sign, another unit, another order.

#include <optional>

#include "harness/diagnosis/causes.h"
#include "harness/recordings/channels.h"
#include "harness/recordings/motion_fit.h"

namespace dexcheck {

/// A fault of recorded positions or torques, and how to undo it.
struct PositionFault {
  Fault fault;
  int joint = -1;                     ///< -1 for all.
  double factor = 1.0, offset = 0.0;  ///< That undo it: factor times what is recorded, plus the offset.
  std::vector<int> order = {};        ///< The joint that each joint's columns are of; empty for its own.
  bool is_motion = true;              ///< Positions, velocities and accelerations.
  bool is_torque = false;             ///< Torques or currents.
  bool has_right_rates = false;       ///< Of the motion, positions alone.

  void Undo(Recording* recording) const;
  void Undo(RecordedSample* sample) const;
};

/// The one that explains most of what gravity, inertia and friction do not, if one explains much.
std::optional<PositionFault> FindPositionFault(const RobotModel& model, Recording recording);

}  // namespace dexcheck
