#include "renders/loaded_library.h"

#include <dlfcn.h>

#include "controller/common/errors.h"

namespace dexcheck {

// What it has is there for the whole process: MuJoCo looks for Mesa so.
LoadedLibrary::LoadedLibrary(const std::string& name)
    : name_(name), handle_(::dlopen(name.c_str(), RTLD_NOW | RTLD_GLOBAL)) {
  if (handle_ == nullptr) throw Error(name_ + ": cannot be loaded: " + ::dlerror());
}

void* LoadedLibrary::FindAddress(const char* name) const {
  void* const address = ::dlsym(handle_, name);
  if (address == nullptr) throw Error(name_ + ": has no function " + name);
  return address;
}

}  // namespace dexcheck
