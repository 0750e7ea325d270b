#include "renders/mesa.h"

#include <dlfcn.h>

#include <string>

#include "controller/common/errors.h"

namespace dexcheck {

const Mesa& LoadMesa() {
  static const Mesa loaded = [] {
    const std::string name = "libOSMesa.so.8";
    // What it has is there for the whole process: MuJoCo looks for Mesa so.
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

}  // namespace dexcheck
