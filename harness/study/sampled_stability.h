#pragma once

// The error dynamics (57) as the plant steps them.
//
// On one axis the law commands the acceleration a = -K_v e_dot - K_p e, from the error at the beginning of a
// step and its rate half a step before; torques, and with them a, are held for m steps of h, T = m h.
// Semi-implicit Euler takes e_dot to e_dot + h a and then e to e + h e_dot, m times:
//
//   [e    ]      [1 - b K_p   T - b K_v] [e    ]            T^2 + h T
//   [e_dot]  ->  [ -T K_p      1 - T K_v] [e_dot]       b = ---------
//                                                               2
// trace = 2 - T K_v - b K_p,  determinant = 1 - T K_v + (T^2 - b) K_p. By Jury's criterion both eigenvalues
// lie inside the unit circle where
//
//   T (1 - h / T) K_p / 2  <  K_v  <  2 / T - h K_p / 2        and K_p > 0
//
// and they are equal, trace^2 = 4 determinant, at K_v = 2 sqrt(K_p) - b K_p / T. For h -> 0 these are the
// continuous K_v > 0 and K_v = 2 sqrt(K_p).
//
// Torques that come late, a state that is measured late, a rate that is differenced and filtered, and motors
// that lag make a longer chain of states (sampled_loop.h). The spectral radius of one period of it, A, is
// lim |A^n|^(1/n), here with n = 2^40 by squaring.

#include <array>
#include <vector>

#include "harness/run/sampled_loop.h"
#include "harness/study/trial.h"

namespace dexcheck {

/// Gains of one axis: K_v in 1/s, K_p in 1/s^2.
struct AxisGains {
  double K_p = 0.0;
  double K_v = 0.0;
  bool operator==(const AxisGains&) const = default;
};

/// Largest |eigenvalue| of one sample.
double CalcSpectralRadius(const SampledLoop& loop, const AxisGains& gains);

/// Errors at the beginning of each of `count` steps of h, from e = 1 and e_dot = 0.
std::vector<double> CalcStepResponse(const SampledLoop& loop, const AxisGains& gains, long count);

// What the sampled error dynamics say of a study's trials.

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
