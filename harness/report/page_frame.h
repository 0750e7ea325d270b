#pragma once

// Texts that are built into the program, for pages that need no other file.

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/report/figure.h"
#include "harness/report/replay.h"

namespace dexcheck {

extern const char* const kPageCss;
extern const char* const kDomJs;  ///< What the other scripts make elements with.
extern const char* const kPageHtml;
extern const char* const kRunJs;
extern const char* const kCampaignJs;
extern const char* const kComparisonJs;
extern const char* const kJudgeJs;
extern const char* const kFilesJs;  ///< Needs kThreeJs.
extern const char* const kPageJs;   ///< Needs kChartsJs.
extern const char* const kReplayHtml;
extern const char* const kReplayJs;
extern const char* const kThreeJs;
extern const char* const kChartJs;   ///< Chart.js: window.Chart.
extern const char* const kChartsJs;  ///< What it gets of a page's charts.

// How a page is put together: built-in markup and scripts, and the data that the scripts make it of.

// Data and texts of pages. A page's script makes its elements of them, so that no text can become markup.

std::string EncodeBase64(std::string_view bytes);

/// A script element that holds data. Text that is no UTF-8 is mended, and nothing in it can end the element.
/// @param id markup already.
std::string EmbedJson(const std::string& id, const nlohmann::ordered_json& json);

/// A script element that holds bytes as base64.
std::string EmbedBytes(const std::string& id, std::string_view bytes);

/// A page that loads nothing.
struct PageParts {
  std::string title;                 ///< Text.
  std::vector<const char*> styles;   ///< On top of those that all pages have.
  std::vector<const char*> markup;   ///< Of the body.
  std::string data;                  ///< Elements, as EmbedJson and EmbedBytes make them.
  std::vector<const char*> scripts;  ///< After dom.js, in their order.
};

/// The whole document.
std::string AssemblePage(const PageParts& parts);

/// Plots over one time.
struct PlotGroup {
  std::string title;  ///< Empty where it is the only one.
  std::span<const Figure> figures;
  VectorXd time;  ///< Of the curves' values, s.
};

/// A page with plots, and a replay where there is one. @param script makes what else is in it.
/// @param data that this script takes.
std::string AssemblePlotPage(const std::string& title, const char* script, const std::string& data,
                             std::span<const PlotGroup> groups, const ReplayData* replay = nullptr);

// The numbers behind the page's plots.

/// In the form that the page's script reads: groups with times, plots, curves, and the curves' values as
/// 4-byte floats, curve by curve.
std::string EmbedPlots(std::span<const PlotGroup> groups);

}  // namespace dexcheck
