#pragma once

// How explanations of all channels begin, and how what was selected is described.

#include <functional>
#include <span>
#include <vector>

#include "harness/diagnosis/cause_estimator.h"
#include "harness/diagnosis/causes.h"
#include "harness/diagnosis/step_store.h"

namespace dexcheck {

/// An explanation of these steps of the store, in order and at least one, without faults.
Explanation StartExplanation(const StepStore& store, CauseChannel channel,
                             const std::vector<Eigen::Index>& steps);

/// Describes a candidate with this amplitude. @param error empty where it is not known.
using DescribeCandidate =
    std::function<Fault(const Candidate& candidate, const VectorXd& amplitude, const VectorXd& error)>;

/// One number: the nominal value and the amplitude.
Fault DescribeNumber(const Candidate& candidate, const VectorXd& amplitude, const VectorXd& error);

/// Returns copies of `start`, an explanation for each candidate that is chosen, with what would do in its
/// place.
/// @param is_explained whether that is enough.
Causes DescribeSelection(const Explanation& start, const CauseSelection& selection,
                         std::span<const Candidate> candidates, const DescribeCandidate& describe,
                         bool is_explained = true);

}  // namespace dexcheck
