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

/// A page that is put together piece by piece.
class PageBuilder {
 protected:
  /// Texts among the arguments are escaped.
  template <typename... Arguments>
  void Add(fmt::format_string<html_detail::Shown<Arguments>...> format, const Arguments&... arguments) {
    html_ += FormatHtml(format, arguments...);
  }
  Html html_;
};

/// Links to the sections, whose ids are their names in small letters.
Html MakeNavigation(const std::vector<std::string>& sections);

/// The section that shows a replay; EndPage brings its scene.
Html MakeReplaySection();

/// The section with a plot for each figure; EndPage brings their numbers.
Html MakePlotSection(const std::vector<Figure>& figures);

/// The plots' numbers and scripts, and the document's end. @param time of the curves' values, s.
Html EndPage(const std::vector<Figure>& figures, const VectorXd& time, const ReplayData* replay = nullptr);

}  // namespace dexcheck
