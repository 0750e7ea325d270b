#pragma once

// What a motor or a sensor may take of the state, or of another signal.

#include <vector>

#include "harness/diagnosis/cause_estimator.h"
#include "harness/diagnosis/signal_causes.h"
#include "harness/diagnosis/signal_shapes.h"

namespace dexcheck {

/// What may be added to a series that nothing simpler explains: crosstalk of another signal of its group, a
/// gain of one sign or a square of the signal, a ripple or a spring over the position, and of motors friction
/// that is smooth or grows with the square of the rate.
std::vector<Candidate> ListCouplings(const SignalSeries& series, const SignalSteps& steps,
                                     const std::vector<SignalSeries>& others);

}  // namespace dexcheck
