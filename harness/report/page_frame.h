#pragma once

// How a page is put together: built-in markup and scripts, and the data that the scripts make it of.

#include <string>
#include <vector>

#include "harness/report/figure.h"
#include "harness/report/page_text.h"
#include "harness/report/replay.h"

namespace dexcheck {

/// A page that loads nothing.
struct PageParts {
  std::string title;                 ///< Text.
  std::vector<const char*> styles;   ///< On top of those that all pages have.
  std::vector<const char*> markup;   ///< Of the body.
  std::string data;                  ///< Elements, as EmbedJson and EmbedBytes make them.
  std::vector<const char*> scripts;  ///< After dom.js, in their order.
  double renew = 0.0;                ///< Seconds after which a browser loads it again; 0 for never.
};

/// The whole document.
std::string AssemblePage(const PageParts& parts);

/// A page with plots, and a replay where there is one. @param script makes what else is in it.
/// @param data that this script takes. @param time of the curves' values, s.
std::string AssemblePlotPage(const std::string& title, const char* script, const std::string& data,
                             const std::vector<Figure>& figures, const VectorXd& time,
                             const ReplayData* replay = nullptr);

}  // namespace dexcheck
