#include "renders/offscreen_context.h"

#include <cstdlib>
#include <mutex>

#include "controller/common/errors.h"
#include "renders/mesa.h"

namespace dexcheck {
namespace {

constexpr int kSurfaceSize = 16;
constexpr int kDepthBits = 24;
constexpr int kStencilBits = 8;

// Each frame is drawn by one thread; videos draw several frames at once in processes instead, which would not
// have their parent's threads. Mesa's cache of shaders wants a home folder, and complains on standard error
// where there is none.
void ConfigureMesa() {
  static std::once_flag once;
  std::call_once(once, [] {
    ::setenv("LP_NUM_THREADS", "0", /*overwrite=*/1);
    ::setenv("MESA_SHADER_CACHE_DISABLE", "true", /*overwrite=*/0);
  });
}

}  // namespace

OffscreenContext::OffscreenContext() : buffer_(4 * kSurfaceSize * kSurfaceSize) {
  ConfigureMesa();
  context_ = LoadMesa().OSMesaCreateContextExt(OSMESA_RGBA, kDepthBits, kStencilBits, 0, nullptr);
  if (context_ == nullptr) throw Error("OSMesa: cannot make an OpenGL context");
  MakeCurrent();
}

OffscreenContext::~OffscreenContext() { LoadMesa().OSMesaDestroyContext(context_); }

void OffscreenContext::MakeCurrent() {
  if (LoadMesa().OSMesaGetCurrentContext() == context_) return;
  if (LoadMesa().OSMesaMakeCurrent(context_, buffer_.data(), GL_UNSIGNED_BYTE, kSurfaceSize, kSurfaceSize) !=
      GL_TRUE) {
    throw Error("OSMesa: cannot make an OpenGL context current");
  }
}

}  // namespace dexcheck
