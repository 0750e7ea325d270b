#pragma once

// How large a fault of each kind can plausibly be.

#include "harness/recordings/torque_candidates.h"

namespace dexcheck {

/// Adds to is_possible that every size is one that a robot of this model, moved so, can have: no torque
/// beyond what is measured and modelled, no gravity above 1 g.
void LimitToPlausible(const RobotModel& model, const MotionExtents& extents, double shaking,
                      TorqueFault* fault);

}  // namespace dexcheck
