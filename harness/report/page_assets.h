#pragma once

// Texts that are built into the program, for pages that need no other file.

namespace dexcheck {

extern const char* const kPageCss;
extern const char* const kPageJs;
extern const char* const kReplayHtml;
extern const char* const kReplayJs;
extern const char* const kThreeJs;
extern const char* const kChartJs;  ///< Chart.js: window.Chart.
extern const char* const kDygraphCss;
extern const char* const kDygraphJs;

}  // namespace dexcheck
