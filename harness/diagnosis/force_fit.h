#pragma once

// Errors of masses, centres of mass, inertias, armature, damping and gravity, solved for by what the forces
// disagree in: what these do not show stays unknown.

#include <vector>

#include "harness/diagnosis/trial.h"

namespace dexcheck {

/// The fewest causes, a single number before others; none when not all of the disagreement is explained.
/// @param trial has the right geometry.
std::vector<Repair> FitForces(const Trial& trial);

}  // namespace dexcheck
