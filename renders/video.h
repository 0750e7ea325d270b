#pragma once

// A run as pictures.

#include <mujoco/mujoco.h>

#include <functional>
#include <string>
#include <vector>

#include "renders/image.h"
#include "renders/run_frames.h"
#include "renders/video_writer.h"

namespace dexcheck {

/// Cameras that move along: near to all that moves, and near to the object. An MJCF's cameras of these names
/// come first.
inline constexpr const char* kRobotCamera = "robot";
inline constexpr const char* kObjectCamera = "object";

struct VideoOptions : EncodingOptions {
  /// One of the model's, kCourseCamera, kRobotCamera or kObjectCamera; empty for "overview", or where the
  /// model has none for the course's.
  std::string camera;
  std::string inset;    ///< A second camera, shown in the lower right corner; none when empty.
  bool forces = false;  ///< Contact forces with their friction cones.
  bool panel = true;    ///< Scenario, time, errors and checks.
  int workers = 2;      ///< Processes that draw, each a frame of its own.
  int samples = 2;      ///< See RenderOptions.
  int shadow_size = 2048;
};

/// A run and the model that it was run with; both must outlive what is made from them.
struct RunView {
  const mjModel* model;
  const RunFrames* frames;
};

/// Draws the instants of a run: the picture `time` seconds after its beginning; after its end the run stands
/// still.
using RunPainter = std::function<Image(double time)>;

/// Makes a painter for this thread. @throws InputError for an unknown camera or frames that CheckRunFrames
/// refuses.
RunPainter MakePainter(const RunView& run, const VideoOptions& options);

/// How many frames show a run: its duration times the frame rate, rounded, at least one.
long CountFrames(const RunView& run, int fps);

/// Draws all frames, in processes that options.workers counts, and writes them to `video` in order, without
/// finishing it. The frames do not depend on the number of processes. Threads would wait for each other:
/// OSMesa has one rasterizer for all contexts of a process and locks it for each picture.
/// @param progress called after each frame with how many of how many are written; false stops the work.
/// @return whether all frames were written.
bool RenderVideo(const RunView& run, const VideoOptions& options, VideoWriter* video,
                 const std::function<bool(long done, long total)>& progress = {});

}  // namespace dexcheck
