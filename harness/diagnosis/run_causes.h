#pragma once

// All that explains a run's residuals.

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// By channel: measurement, actuation, law, contact, rolling, balance. Empty where nothing differs.
/// @param void_from of FindVoid, s: wheels and balances are explained up to then.
Causes ExplainRun(const StepStore& store, double void_from);

}  // namespace dexcheck
