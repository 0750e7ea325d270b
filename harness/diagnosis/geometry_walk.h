#pragma once

// Errors of geometry, found from the base outward.

#include <functional>
#include <vector>

#include "harness/diagnosis/placement.h"
#include "harness/diagnosis/repair.h"

namespace dexcheck {

/// Explains misplaced axes, frames and bodies by changes of rows, of the places where chains and frames
/// start, of the sign of an axis, or of two joints' order.
///
/// Always the misplaced link nearest the base is taken: what carries it is right, so what is wrong is its own
/// joint or one that moves nothing else that is compared. Each number there is solved for by itself, and the
/// one after whose repair the fewest things are misplaced is taken; then the walk goes on.
/// @param start the trial that is to be repaired.
/// @param force_error a measure of the forces' disagreement with a robot, which decides between repairs that
///   place everything alike.
/// @return causes in the order found, each to be repaired after those before it.
std::vector<Repair> WalkGeometry(const Placement& start,
                                 const std::function<double(const RobotSpec& written)>& force_error);

}  // namespace dexcheck
