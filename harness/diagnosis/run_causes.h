#pragma once

// All that explains a run's residuals.

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// By channel: measurement, actuation, law, balance. Empty where nothing differs.
Causes ExplainRun(const StepStore& store);

}  // namespace dexcheck
