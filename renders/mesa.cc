#include "renders/mesa.h"

#include "renders/loaded_library.h"

namespace dexcheck {

const Mesa& LoadMesa() {
  static const Mesa loaded = [] {
    const LoadedLibrary library("libOSMesa.so.8");
    Mesa mesa{};
#define DEXCHECK_FIND(name) library.Find(#name, &mesa.name);
    DEXCHECK_MESA(DEXCHECK_FIND)
#undef DEXCHECK_FIND
    return mesa;
  }();
  return loaded;
}

}  // namespace dexcheck
