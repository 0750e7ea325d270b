#pragma once

#include <vector>

#include "harness/report/figure.h"
#include "harness/report/run_data.h"

namespace dexcheck {

/// Panels of the paper's Figures 12 and 13, as far as the log has their signals, and plots beside them: the
/// object's error, the other torques, how far friction is used.
std::vector<Figure> MakeMotionFigures(const RunData& run);

/// One figure for each category of checks that was evaluated: its checks' values as fractions of their
/// bounds.
std::vector<Figure> MakeResidualFigures(const RunData& run);

}  // namespace dexcheck
