#pragma once

#include "harness/descriptions/constant_checks.h"

namespace dexcheck {

/// Adds to `result` what the MJCF has and the analytic model has no number for: tendons' forces, equality
/// constraints, motors that are no plain torque sources, flags, contacts with friction, distance or a floor
/// that the model does not know. Anything but the neutral value is a finding. What a run of the plant
/// overrides or judges (contacts, solver, motors' limits) becomes a note.
void FindEngineOnly(const Adapter& adapter, ConstantChecks* result);

}  // namespace dexcheck
