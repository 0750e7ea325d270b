#pragma once

#include <string>

namespace dexcheck {

/// The text as one word of a POSIX shell: in single quotes, unless it needs none.
std::string QuoteForShell(const std::string& text);

}  // namespace dexcheck
