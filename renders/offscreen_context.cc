#include "renders/offscreen_context.h"

#include <dlfcn.h>

#include <cstdlib>
#include <mutex>
#include <string>
#include <string_view>

#include "controller/common/errors.h"

namespace dexcheck {

const Mesa& LoadMesa() {
  static const Mesa loaded = [] {
    const std::string name = "libOSMesa.so.8";
    // The library's symbols are global, because MuJoCo looks for Mesa among them.
    void* const library = ::dlopen(name.c_str(), RTLD_NOW | RTLD_GLOBAL);
    if (library == nullptr) throw Error(name + ": cannot be loaded: " + ::dlerror());
    const auto find = [&](const char* function) {
      void* const address = ::dlsym(library, function);
      if (address == nullptr) throw Error(name + ": has no function " + function);
      return address;
    };
    Mesa mesa{};
#define DEXCHECK_FIND(function) mesa.function = reinterpret_cast<decltype(mesa.function)>(find(#function));
    DEXCHECK_MESA(DEXCHECK_FIND)
#undef DEXCHECK_FIND
    return mesa;
  }();
  return loaded;
}

namespace {

constexpr int kSurfaceSize = 16;
constexpr int kDepthBits = 24;
constexpr int kStencilBits = 8;

// Each frame is drawn by one thread; videos draw several frames at once in processes instead, which would not
// have their parent's threads. Mesa's cache of shaders wants a home folder, and complains on standard error
// where there is none. OSMesa has two drivers and crashes when the environment names another one, such as the
// d3d12 of WSL2.
void ConfigureMesa() {
  static std::once_flag once;
  std::call_once(once, [] {
    ::setenv("LP_NUM_THREADS", "0", /*overwrite=*/1);
    ::setenv("MESA_SHADER_CACHE_DISABLE", "true", /*overwrite=*/0);
    const char* const driver = std::getenv("GALLIUM_DRIVER");
    if (driver != nullptr && std::string_view(driver) != "softpipe") ::unsetenv("GALLIUM_DRIVER");
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
