# Writes OUT, the source of version.h, when it would change: cmake -DOUT=... -DSOURCE=... -DVERSION=... -P this
find_program(git git)
set(revision "")
if(git AND EXISTS ${SOURCE}/.git)
  execute_process(COMMAND ${git} -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude=*
    OUTPUT_VARIABLE revision OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
file(CONFIGURE OUTPUT ${OUT} CONTENT [[#include "harness/base/version.h"
const char* dexcheck::Version() { return "@VERSION@"; }
const char* const dexcheck::kGitRevision = "@revision@";
]] @ONLY)
