#pragma once

// Pictures drawn in processes of their own, several at a time.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "harness/base/child_process.h"
#include "renders/image.h"

namespace dexcheck {

/// Gives memory that processes share back to the system.
struct UnmapMemory {
  std::size_t size = 0;  ///< Bytes.
  void operator()(std::uint8_t* memory) const;
};

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
  /// @throws Error when there is no memory for pictures or no process can be made.
  FrameLine(const std::function<Painter()>& make_painter, long frames, int workers, int width, int height);

  /// The next frame, at most `frames` times. At most two frames of each process wait to be taken.
  /// @throws what the frame's process threw: InputError and std::invalid_argument as such, everything else
  /// as Error; also Error when the process died.
  Image Take();

 private:
  bool Work(const std::function<Painter()>& make_painter, long first, int channel) const;
  void Draw(const std::function<Painter()>& make_painter, long first, int channel) const;
  [[nodiscard]] std::uint8_t* FindSlot(long frame) const;
  [[noreturn]] static void Fail(ChildProcess* worker, char told);

  long frames_;
  long num_workers_;
  int width_;
  int height_;
  long taken_ = 0;
  std::size_t size_ = 0;                                // bytes of all slots
  std::unique_ptr<std::uint8_t[], UnmapMemory> slots_;  // shared by all processes
  std::vector<ChildProcess> workers_;                   // tell of drawn frames, and are told of those taken
};

}  // namespace dexcheck
