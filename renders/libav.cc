#include "renders/libav.h"

#include "renders/loaded_library.h"

namespace dexcheck::libav {
namespace {

LoadedLibrary LoadPart(const char* name, int version) {
  return LoadedLibrary(std::string("lib") + name + ".so." + std::to_string(version));
}

}  // namespace

const Functions& Load() {
  static const Functions loaded = [] {
    Functions functions{};
#define DEXCHECK_FIND(name) library.Find(#name, &functions.name);
    {
      const LoadedLibrary library = LoadPart("avutil", LIBAVUTIL_VERSION_MAJOR);
      DEXCHECK_AVUTIL(DEXCHECK_FIND)
    }
    {
      const LoadedLibrary library = LoadPart("avcodec", LIBAVCODEC_VERSION_MAJOR);
      DEXCHECK_AVCODEC(DEXCHECK_FIND)
    }
    {
      const LoadedLibrary library = LoadPart("avformat", LIBAVFORMAT_VERSION_MAJOR);
      DEXCHECK_AVFORMAT(DEXCHECK_FIND)
    }
    {
      const LoadedLibrary library = LoadPart("swscale", LIBSWSCALE_VERSION_MAJOR);
      DEXCHECK_SWSCALE(DEXCHECK_FIND)
    }
#undef DEXCHECK_FIND
    functions.av_log_set_level(AV_LOG_QUIET);
    return functions;
  }();
  return loaded;
}

}  // namespace dexcheck::libav
