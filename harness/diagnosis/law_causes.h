#pragma once

// Which summand of the law is wrong, of all torques or of one joint, finger or wheel.

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// Explains E_bar' (tau' - tau'_printed) = sum_i (factor_i - 1) part_i by the summands of the reference law.
Causes ExplainLaw(const StepStore& store);

}  // namespace dexcheck
