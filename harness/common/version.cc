#include "harness/common/version.h"

namespace dexcheck {

const char* Version() { return DEXCHECK_VERSION; }

}  // namespace dexcheck
