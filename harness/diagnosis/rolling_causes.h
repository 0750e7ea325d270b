#pragma once

// Which radius or distance wheels have that do not roll as the model has it.

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// Explains v +- w b / 2 - r thetadot of both wheels: another radius leaves dr thetadot, another distance
/// -+ w db / 2. What wheels slip and sink is noise.
Causes ExplainRolling(const StepStore& store);

}  // namespace dexcheck
