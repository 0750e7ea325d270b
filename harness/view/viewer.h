#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "harness/view/live_run.h"

namespace dexcheck {

struct ViewerOptions {
  int width = 1120;
  int height = 640;
  double speed = 1.0;
  bool paused = false;
};

/// Makes a run, with the scenario's own overrides followed by these.
using LiveRunMaker = std::function<std::unique_ptr<LiveRun>(const std::vector<std::string>& more_overrides)>;

/// Shows a recording until the window is closed. @throws InputError when there is no display.
void ViewRecording(const FrameSource& recording, const std::string& title, const ViewerOptions& options);

/// Shows a run that goes on. Sliders start it anew with other gains.
/// @param save writes the run's scenario, its mouse forces included, and says where.
/// @returns the last of the runs, finished.
std::unique_ptr<LiveRun> ViewLive(const LiveRunMaker& make, const std::string& title,
                                  const ViewerOptions& options,
                                  const std::function<std::string(const LiveRun& run)>& save);

}  // namespace dexcheck
