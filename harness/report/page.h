#pragma once

// The page of evidence.

#include <filesystem>
#include <string>
#include <vector>

#include "harness/report/figure.h"
#include "harness/report/run_data.h"
#include "harness/report/run_scene.h"

namespace dexcheck {

/// What stands in the page besides the run.
struct PageContent {
  std::vector<Figure> figures;  ///< Plots that can be zoomed.
  RunScene scene;               ///< Pictures and replay.
  std::filesystem::path video;  ///< Empty for none.
  std::string video_link;       ///< From the page to the video, used when it is too large to be embedded.
};

/// A whole HTML document that loads nothing: verdict, evidence, replay, video, pictures, plots, checks,
/// inputs.
/// @throws InputError that names the log when its summary is none.
std::string MakePage(const RunData& run, const PageContent& content);

}  // namespace dexcheck
