#pragma once

#include <cstdint>
#include <memory>
#include <vector>

struct osmesa_context;

namespace dexcheck {

/// An OpenGL context in software that needs neither a display nor a graphics card. It belongs to the thread
/// that makes it. The process must not link EGL: MuJoCo's OpenGL loader would prefer it.
class OffscreenContext {
 public:
  /// Makes the context and makes it current. Drawing happens in the calling thread, one picture of the
  /// process at a time.
  /// @throws Error when the OpenGL library cannot make one.
  OffscreenContext();
  ~OffscreenContext();
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

  /// Further OpenGL calls of this thread go to this context. @throws Error.
  void MakeCurrent();

 private:
  osmesa_context* context_ = nullptr;
  std::vector<std::uint8_t> buffer_;  // the context's own surface; MuJoCo draws into one of its own
};

}  // namespace dexcheck
