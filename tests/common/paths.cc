#include "tests/common/paths.h"

namespace dexcheck::testing {

std::string SourcePath(const std::string& name) { return DEXCHECK_SOURCE_DIR + name; }

std::string BuildPath(const std::string& name) { return DEXCHECK_BUILD_DIR + name; }

std::string ProgramPath() { return BuildPath("/bin/dexcheck"); }

}  // namespace dexcheck::testing
