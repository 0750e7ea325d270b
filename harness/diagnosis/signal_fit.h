#pragma once

// The explanation of one signal: a transmission, and what is added to it.

#include <string>
#include <vector>

#include "harness/diagnosis/signal_causes.h"
#include "harness/diagnosis/signal_shapes.h"

namespace dexcheck {

/// A whole explanation of a series.
struct SignalFit {
  std::vector<Fault> faults;
  std::vector<std::vector<Fault>> same;  // of each fault, what would do in its place
  CauseSelection selection;
  double criterion = 0.0;
  double size = 0.0;  // |y|, whitened
  bool is_noise = false;

  [[nodiscard]] bool is_possible() const { return !faults.empty(); }
};

/// The explanations of one series, the most likely first.
struct SignalVerdict {
  SignalName name;
  SignalSteps steps;
  std::vector<SignalFit> fits;  // that are equally likely
  std::string rival;
  double log_odds = 0.0;
  bool is_explained = false;
};

/// @param others whose signal this one may have got; it is one of them itself. @returns one without steps
/// where nothing differs.
SignalVerdict JudgeSignal(const SignalSeries& series, const std::vector<SignalSeries>& others);
/// An explanation without faults.
Explanation StartExplanation(const SignalVerdict& verdict, CauseChannel channel);
/// One explanation for each fault, with what would do in its place.
void AddExplanations(const SignalVerdict& verdict, CauseChannel channel, Causes* causes);

}  // namespace dexcheck
