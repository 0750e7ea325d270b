#pragma once

// Texts that are built into the program, for pages that need no other file.

namespace dexcheck {

extern const char* const kStudyCss;
extern const char* const kExplorerJs;

}  // namespace dexcheck
