#pragma once

// Faults of the controller's model and of its law, one after the other rather than drawn.

#include <vector>

#include "harness/injection/drawn_faults.h"

namespace dexcheck {

/// `count` numbers of the model, evenly out of all, changed by `scale` relative to GetScale.
std::vector<FaultSet> ListNumberFaults(const Setup& setup, size_t count, double scale);
/// Each part of (55) a thousandth too large and left out, and what else may be wrong in it.
std::vector<FaultSet> ListLawFaults(const Setup& setup);
/// Wrong equations of the model that the law goes by.
std::vector<FaultSet> ListEquationFaults(const Setup& setup);

}  // namespace dexcheck
