#pragma once

// Pictures drawn in processes of their own, several at a time.

#include <functional>
#include <vector>

#include "harness/base/child_process.h"
#include "renders/image.h"

namespace dexcheck {

/// Processes that draw the frames of a video, each every n-th, and hand them over in order. Threads would
/// wait for each other: OSMesa has one rasterizer for all contexts of a process and locks it for each
/// picture. The processes end with the line.
class FrameLine {
 public:
  /// Draws frame number `frame`.
  using Painter = std::function<Image(long frame)>;

  /// Begins to draw. Forks, so no other thread of this process may be drawing.
  /// @param make_painter called once in each process.
  /// @param frames how many, numbered from 0.
  /// @param workers how many processes at most.
  /// @param width, height of all pictures.
  /// @throws Error when no process can be made.
  FrameLine(const std::function<Painter()>& make_painter, long frames, int workers, int width, int height);

  /// The next frame, at most `frames` times. A process draws on until its channel is full.
  /// @throws what the frame's process threw: InputError and std::invalid_argument as such, everything else
  /// as Error; also Error when the process died.
  Image Take();

 private:
  long frames_;
  int width_;
  int height_;
  long taken_ = 0;
  std::vector<ChildProcess> workers_;  // they send pictures, or what went wrong
};

}  // namespace dexcheck
