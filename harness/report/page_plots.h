#pragma once

// The numbers behind the page's plots.

#include <string>
#include <vector>

#include "harness/report/figure.h"

namespace dexcheck {

/// In the form that the page's script reads.
struct PlotData {
  std::string json;    ///< Times, plots, curves; safe inside a script element.
  std::string values;  ///< Base64 of the curves' values as 4-byte floats, curve by curve.
};

/// @param time of the curves' values, s.
PlotData MakePlotData(const std::vector<Figure>& figures, const VectorXd& time);

}  // namespace dexcheck
