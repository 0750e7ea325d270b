#pragma once

// What all pages have around their content.

#include <string>
#include <vector>

#include "harness/report/figure.h"
#include "harness/report/html.h"
#include "harness/report/replay.h"

namespace dexcheck {

/// From the document's beginning to the beginning of its body, with the styles that all pages have.
/// @param style on top of them. @param renew after how many seconds it is loaded again; 0 for never.
Html BeginPage(const std::string& title, const Html& style, double renew = 0.0);

/// Likewise, of a page with plots.
Html BeginPlotPage(const std::string& title);

/// The section that shows a replay; EndPage brings its scene.
Html MakeReplaySection();

/// The section with a plot for each figure; EndPage brings their numbers.
Html MakePlotSection(const std::vector<Figure>& figures);

/// The plots' numbers and scripts, and the document's end. @param time of the curves' values, s.
Html EndPage(const std::vector<Figure>& figures, const VectorXd& time, const ReplayData* replay = nullptr);

}  // namespace dexcheck
