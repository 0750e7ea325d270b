#pragma once

// The page of a comparison of runs.

#include <string>
#include <vector>

#include "harness/report/run_comparison.h"

namespace dexcheck {

/// A whole HTML document that loads nothing: verdict, inputs that differ, results and checks side by side,
/// the signals that differ most, overlaid and subtracted.
/// @param names what the runs are called, such as their folders.
std::string MakeComparisonPage(const std::vector<const RunData*>& runs, const std::vector<std::string>& names,
                               const RunComparison& comparison);

}  // namespace dexcheck
