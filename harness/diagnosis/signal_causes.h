#pragma once

// How what arrived differs from what should have: torques that motors gave, readings that were measured.

#include <limits>
#include <vector>

#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// One motor or one entry of a reading, step by step.
struct SignalSeries {
  SignalName name;
  VectorXd time;                  ///< s
  VectorXd expected, got;         ///< What it should be, and what it was.
  VectorXd rate, position;        ///< Of what it moves; empty for none.
  std::vector<bool> has_history;  ///< Whether the steps before each are those before it here.
  double noise = 0.0;             ///< Rounding of got - expected.
  /// Torque of a motor that has no finer steps: a hundredth of its limit, N m or N.
  double coarsest = std::numeric_limits<double>::infinity();
  /// When it differs first and last, of all steps, s; NaN where these steps alone show it.
  double from = std::numeric_limits<double>::quiet_NaN(), to = from;
  /// In units of the noise: the least error that a cause is looked for, and the most that an explanation may
  /// leave.
  static constexpr double kFaint = 1e3, kLeft = 30.0;
};

/// Explains got - expected of the signals of one channel: a transmission (none, a delay, a limit, a dead
/// zone, steps, the signal of another one, a stuck value, play), with gain, offset, friction, drift, lag or a
/// ripple of its result, or noise. One for each fault; none where nothing differs. A fault that several have
/// alone and with the same value is listed once.
Causes ExplainSignals(std::vector<SignalSeries> series, CauseChannel channel);
/// All motors, and all readings.
Causes ExplainSignals(const StepStore& store);

}  // namespace dexcheck
