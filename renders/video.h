#pragma once

// A run as pictures.

#include <mujoco/mujoco.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/base/child_process.h"
#include "harness/base/files.h"
#include "renders/image.h"
#include "renders/viewpoint.h"

namespace dexcheck {

struct EncodingOptions {
  int width = 1280;  ///< Even.
  int height = 720;  ///< Even.
  int fps = 30;      ///< Frames a second.
};

/// Writes a video that browsers play while it loads, frame by frame: H.264 (yuv420p, BT.709) in MP4, whose
/// index stands before the data. The program ffmpeg encodes it. The file appears under its name when it is
/// finished; until then, and after an error, there is nothing.
class VideoWriter {
 public:
  /// @throws InputError "PATH: cannot be written: reason".
  /// @throws std::invalid_argument for sizes or rates that the format cannot take.
  VideoWriter(const std::filesystem::path& path, const EncodingOptions& options);
  ~VideoWriter();

  /// Appends a frame of the options' size. @throws InputError as the constructor.
  void Write(const Image& image);
  /// Completes the file. @throws InputError as the constructor, also when there was no frame.
  void Finish();

  [[nodiscard]] long frames() const { return frames_; }

 private:
  void CloseInput();
  void FinishEncoding();

  PartialFile file_;
  EncodingOptions options_;
  FileDescriptor input_;  // this end of what ffmpeg reads
  MessageFile messages_;
  std::optional<ChildProcess> process_;
  long frames_ = 0;
};

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
