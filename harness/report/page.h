#pragma once

// The page of evidence.

#include <filesystem>
#include <string>
#include <vector>

#include "harness/report/figure.h"
#include "harness/report/run_data.h"

namespace dexcheck {

/// A picture of the run, made elsewhere.
struct Picture {
  std::filesystem::path file;  ///< PNG.
  std::string panel;           ///< Number in the paper, "11 (a)"; or empty.
  std::string title;
};

/// What stands in the page besides the run.
struct PageContent {
  std::vector<Figure>
      figures;  ///< Plots that can be zoomed; those that are printed stand there as pictures, too.
  std::filesystem::path drawings;  ///< Folder with the SVG files of the printed figures.
  std::vector<Picture> pictures;
  std::filesystem::path video;  ///< Empty for none.
  std::string video_link;       ///< From the page to the video, used when it is too large to be embedded.
};

/// A whole HTML document that loads nothing: verdict, evidence, checks, plots, video, figures, parameters.
/// @throws InputError that names the log when its summary is none.
std::string MakePage(const RunData& run, const PageContent& content);

}  // namespace dexcheck
