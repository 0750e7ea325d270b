#pragma once

// Faults of the balances in words.

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_forces.h"

namespace dexcheck {

/// When a push was nothing, s. @param a what it grows by a second, and its size at time `end`.
double CalcGrowthBegin(const VectorXd& a, double end);

/// Describes a fault; vectors of a body are in the link's own axes, as its file gives them.
/// @param amplitude its amplitudes. @param error their standard errors; empty for none.
Fault MakeForceFault(const Candidate& candidate, const VectorXd& amplitude, const VectorXd& error,
                     const RobotModel& model);

}  // namespace dexcheck
