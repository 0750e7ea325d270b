#pragma once

// A run as pictures.

#include <mujoco/mujoco.h>

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "renders/image.h"
#include "renders/run_frames.h"
#include "renders/video_writer.h"

namespace dexcheck {

/// A camera that stands where one wants.
struct FreeCamera {
  Vector3d from = Vector3d::Zero();  ///< At the run's beginning, m, world.
  std::optional<Vector3d> look_at;   ///< m, world; none for the object, wherever it is.
  bool follow = false;               ///< Camera and fixed point move along with the object.
  double orbit = 0.0;                ///< About the vertical through what it looks at, rad/s.
};

/// Cameras that move along: near to all that moves, and near to the object. An MJCF's cameras of these names
/// come first.
inline constexpr const char* kRobotCamera = "robot";
inline constexpr const char* kObjectCamera = "object";

struct VideoOptions {
  int width = 1280;
  int height = 720;
  int fps = 30;
  /// One of the model's, kCourseCamera, kRobotCamera or kObjectCamera; empty for "overview", or where the
  /// model has none for the course's.
  std::string camera;
  std::optional<FreeCamera> free;  ///< Instead of `camera`.
  std::string inset;               ///< A second camera, shown in the lower right corner; none when empty.
  bool forces = false;             ///< Contact forces with their friction cones.
  bool tracks =
      false;  ///< Where the contacts have been on the object, and the object's path beside the desired one.
  bool frames = false;  ///< The object's axes.
  bool ghost = false;   ///< Of two runs, the second one in the first one's scene and not beside it.
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

/// Draws the instants of one run, or of two: side by side, each seen by cameras of its own, or in one scene.
/// For the thread that made it.
class VideoPainter {
 public:
  /// @param runs one or two.
  /// @throws InputError for an unknown camera or frames that CheckRunFrames refuses.
  VideoPainter(std::span<const RunView> runs, const VideoOptions& options);
  ~VideoPainter();
  VideoPainter(const VideoPainter&) = delete;
  VideoPainter& operator=(const VideoPainter&) = delete;

  /// The picture `time` seconds after the runs' beginning; after its end a run stands still.
  Image Paint(double time);

 private:
  class RunPainter;
  std::vector<std::unique_ptr<RunPainter>> painters_;
};

/// How many frames show the longest of the runs: its duration times the frame rate, rounded, at least one.
long CountFrames(std::span<const RunView> runs, int fps);

/// Draws all frames, in processes that options.workers counts, and writes them to `video` in order, without
/// finishing it. The frames do not depend on the number of processes. Threads would wait for each other:
/// OSMesa has one rasterizer for all contexts of a process and locks it for each picture.
/// @param progress called after each frame with how many of how many are written; false stops the work.
/// @return whether all frames were written.
bool RenderVideo(std::span<const RunView> runs, const VideoOptions& options, VideoWriter* video,
                 const std::function<bool(long done, long total)>& progress = {});

}  // namespace dexcheck
