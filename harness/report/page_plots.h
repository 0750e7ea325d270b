#pragma once

// The numbers behind the page's plots.

#include <string>
#include <vector>

#include "harness/report/figure.h"

namespace dexcheck {

/// In the form that the page's script reads: times, plots, curves, and the curves' values as 4-byte floats,
/// curve by curve. @param time of the curves' values, s.
std::string EmbedPlots(const std::vector<Figure>& figures, const VectorXd& time);

}  // namespace dexcheck
