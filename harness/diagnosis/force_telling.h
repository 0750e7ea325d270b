#pragma once

// Faults of the balances in words, and the steps that they are sought in.

#include <vector>

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_forces.h"

namespace dexcheck {

/// When a push was nothing, s. @param a what it grows by a second, and its size at time `end`.
double CalcGrowthBegin(const VectorXd& a, double end);

/// Describes a fault; vectors of a body are in the link's own axes, as its file gives them.
/// @param amplitude its amplitudes. @param error their standard errors; empty for none.
Fault MakeForceFault(const Candidate& candidate, const VectorXd& amplitude, const VectorXd& error,
                     const RobotModel& model);

/// Steps of a store that differ.
using Segment = std::vector<Eigen::Index>;

/// All steps that differ, and the same in parts that begin or end with a jump. @param level of the noise, in
/// bounds of the checks.
void FindSegments(const StepStore& store, StepForces* forces, double level, Segment* whole,
                  std::vector<Segment>* parts);

}  // namespace dexcheck
