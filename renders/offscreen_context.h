#pragma once

#include <GL/osmesa.h>

#include <cstdint>
#include <vector>

namespace dexcheck {

// Mesa's off-screen OpenGL, loaded when the first context is made: with LLVM in it, it takes 60 ms of
// processor time to load, and most commands draw nothing.

/// The functions that are called here; MuJoCo finds its own.
struct Mesa {
// clang-format off
#define DEXCHECK_MESA(X)                                                                             \
  X(OSMesaCreateContextExt) X(OSMesaDestroyContext) X(OSMesaGetCurrentContext) X(OSMesaMakeCurrent)  \
  X(glBegin) X(glDeleteLists) X(glEnd) X(glEndList) X(glGenLists) X(glNewList) X(glNormal3dv)        \
  X(glNormal3f) X(glVertex3dv) X(glVertex3f)
// clang-format on
// A member's name stands without parentheses. NOLINTNEXTLINE(bugprone-macro-parentheses)
#define DEXCHECK_FUNCTION(name) decltype(&::name) name;
  DEXCHECK_MESA(DEXCHECK_FUNCTION)
#undef DEXCHECK_FUNCTION
};

/// @throws Error when the library is not there.
const Mesa& LoadMesa();

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
  OSMesaContext context_ = nullptr;
  std::vector<std::uint8_t> buffer_;  // the context's own surface; MuJoCo draws into one of its own
};

}  // namespace dexcheck
