#include "harness/run/foreign_library.h"

#include <dlfcn.h>

#include <vector>

#include "controller/common/errors.h"

namespace dexcheck {

void KeepForEver(void* what) {
  static std::vector<void*> kept;
  kept.push_back(what);
}

void ForeignLibrary::Close::operator()(void* handle) const { dlclose(handle); }

ForeignLibrary::ForeignLibrary(const OwnControllerSetup& setup)
    : name_(setup.name), code_(setup.own.time_limit) {
  Guard([&] { handle_.reset(dlopen(FindControllerFile(setup.own).c_str(), RTLD_NOW | RTLD_LOCAL)); },
        kPatience);
  if (handle_ == nullptr) throw InputError(name_ + ": " + dlerror());
}

ForeignLibrary::~ForeignLibrary() {
  if (is_broken_) KeepForEver(handle_.release());
}

void* ForeignLibrary::FindSymbol(const char* name) const { return dlsym(handle_.get(), name); }

}  // namespace dexcheck
