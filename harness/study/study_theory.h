#pragma once

// What the sampled error dynamics say of a study's trials.

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "harness/study/sampled_stability.h"
#include "harness/study/trial.h"

namespace dexcheck {

/// Whether (57) is stable on all axes at these values of the varied keys. @throws InputError as
/// MakeTrialScenario.
bool IsStableInTheory(const StudyInputs& inputs, const std::vector<double>& parameters);

/// Largest |eigenvalue| of one sample of (57) of all axes.
double CalcRadiusInTheory(const StudyInputs& inputs, const std::vector<double>& parameters);

/// Whether it is damped at least critically on all axes (IsDamped).
bool IsDampedInTheory(const StudyInputs& inputs, const std::vector<double>& parameters);

/// Overshoot of the step response to the start error within the run, relative to it; 0 when there is none.
/// The largest of the axes on which the object starts beside its place.
double CalcOvershootInTheory(const StudyInputs& inputs, const std::vector<double>& parameters);

/// Metrics of the object's position as (57) alone makes them of the start error: rms, maximum, settling time,
/// overshoot, growth, over the steps of the run. In a loop that is not sampled, and a run of time T that is
/// long enough, rms^2 T = sum over the axes of e0^2 (K_v^2 + K_p) / (2 K_v K_p).
/// @returns NaN for all other metrics, and for these too where the object does not start beside its place,
/// where (57) is unstable, or where more than it moves the object: another law, a plant that is not ideal in
/// anything but delay, latency, the filter of the object's velocity and lag.
TrialResult PredictInTheory(const StudyInputs& inputs, const std::vector<double>& parameters);

/// Metrics that PredictInTheory knows.
inline constexpr std::array kPredictedMetrics = {kPositionErrorRms, kPositionErrorMax, kSettlingTime,
                                                 kOvershoot, kErrorGrowth};

/// Objectives of a point in theory, over the study's draws; infeasible where (57) does not know one of them.
/// Constraints do not count. @param values of the study's own keys.
Judgement JudgeInTheory(const StudyInputs& inputs, const std::vector<double>& values);

/// The least first objective that (57) has within the ranges of the keys, whatever the constraints; none
/// where it does not know it.
std::optional<double> FindLeastInTheory(const StudyInputs& inputs);

using TheoryTest = std::function<bool(const StudyInputs&, const std::vector<double>&)>;

/// Points (value of the first varied key, value of the second) at which `holds` turns over, the other keys at
/// the parameters given; found along the second key.
std::vector<std::pair<double, double>> FindTurns(const StudyInputs& inputs,
                                                 const std::vector<double>& parameters,
                                                 const TheoryTest& holds);

/// What (57) says along the keys of a study, each of them on the axes that it changes.
struct KeyTheory {
  /// A value of one key at which (57) turns from stable to unstable, or (not `is_stability`) from damped to
  /// overshooting.
  struct Turn {
    size_t key = 0;
    bool is_stability = true;
    double value = 0.0;
  };
  /// Values of two keys at which it turns.
  struct Curve {
    size_t x = 0;  ///< Key.
    size_t y = 0;
    bool is_stability = true;
    std::vector<std::pair<double, double>> points;
  };
  std::vector<bool> knows;  ///< By key: whether (57) has it at all.
  std::vector<Turn> turns;
  std::vector<Curve> curves;  ///< Of the first pairs of keys that both change one axis.
};

/// @param parameters values of the other keys.
KeyTheory FindKeyTheory(const StudyInputs& inputs, const std::vector<double>& parameters);

}  // namespace dexcheck
