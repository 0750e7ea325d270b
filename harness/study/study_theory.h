#pragma once

// What the sampled error dynamics say of a study's trials.

#include <functional>
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

/// Whether it is damped at least critically on all axes.
bool IsDampedInTheory(const StudyInputs& inputs, const std::vector<double>& parameters);

/// Overshoot of the step response to the start error within the run, relative to it; 0 when there is none.
/// The largest of the axes on which the object starts beside its place.
double CalcOvershootInTheory(const StudyInputs& inputs, const std::vector<double>& parameters);

using TheoryTest = std::function<bool(const StudyInputs&, const std::vector<double>&)>;

/// Points (value of the first varied key, value of the second) at which `holds` turns over, the other keys at
/// the parameters given; found along the second key.
std::vector<std::pair<double, double>> FindTurns(const StudyInputs& inputs,
                                                 const std::vector<double>& parameters,
                                                 const TheoryTest& holds);

}  // namespace dexcheck
