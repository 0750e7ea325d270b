#pragma once

// Texts that are built into the program, for pages that need no other file.

namespace dexcheck {

extern const char* const kPageCss;
extern const char* const kDomJs;  ///< What the other scripts make elements with.
extern const char* const kPageHtml;
extern const char* const kRunJs;
extern const char* const kCampaignJs;
extern const char* const kComparisonJs;
extern const char* const kJudgeJs;
extern const char* const kPageJs;  ///< Needs kChartsJs.
extern const char* const kReplayHtml;
extern const char* const kReplayJs;
extern const char* const kThreeJs;
extern const char* const kChartJs;   ///< Chart.js: window.Chart.
extern const char* const kChartsJs;  ///< What it gets of a page's charts.

}  // namespace dexcheck
