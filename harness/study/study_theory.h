#pragma once

// What the sampled error dynamics say of a study's trials.

#include <array>
#include <vector>

#include "harness/study/trial.h"

namespace dexcheck {

/// What (57) says of one trial, stepped as the plant steps it.
struct Theory {
  double radius = 0.0;  ///< Largest |eigenvalue| of one sample, of all axes.
  /// Metrics of the object's position as (57) alone makes them of the start error: rms, maximum, settling
  /// time, overshoot, growth, over the steps of the run. In a loop that is not sampled, and a run of time T
  /// that is long enough, rms^2 T = sum over the axes of e0^2 (K_v^2 + K_p) / (2 K_v K_p).
  /// NaN for all other metrics, and for these too where the object does not start beside its place, where
  /// (57) is unstable, or where more than it moves the object: another law, a plant that is not ideal in
  /// anything but delay, latency, the filter of the object's velocity and lag.
  std::array<double, kNumMetrics> metrics{};
  [[nodiscard]] bool is_stable() const { return radius < 1.0; }
};

/// @param parameters values of the varied keys. @throws InputError as MakeTrialScenario.
Theory CalcTheory(const StudyInputs& inputs, const std::vector<double>& parameters);

/// Metrics that CalcTheory knows.
inline constexpr std::array kPredictedMetrics = {kPositionErrorRms, kPositionErrorMax, kSettlingTime,
                                                 kOvershoot, kErrorGrowth};

}  // namespace dexcheck
