#include "harness/base/version.h"

namespace dexcheck {

const char* Version() { return DEXCHECK_VERSION; }

}  // namespace dexcheck
