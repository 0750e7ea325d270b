#pragma once

// Which shapes of fingertips and object explain that they touch at another distance than the declared ones.

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// Whether they touch at another distance.
bool HasOtherShapes(const StepStore& store);

Causes ExplainContacts(const StepStore& store);

}  // namespace dexcheck
