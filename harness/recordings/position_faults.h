#pragma once

// Positions of a recording that are not the model's: another sign, another unit, another order.

#include <functional>
#include <optional>
#include <vector>

#include "harness/diagnosis/causes.h"
#include "harness/recordings/channels.h"

namespace dexcheck {

/// What was done to positions, and how to undo it.
struct PositionFault {
  Fault fault;
  std::function<void(Recording*)> undo;  ///< Changes the channels.
};

/// The one that explains most of what gravity, inertia and friction do not, if one explains much.
/// @param recording can be opened again.
std::optional<PositionFault> FindPositionFault(const RobotModel& model, const Recording& recording);

}  // namespace dexcheck
