#pragma once

// Comma-separated values.

#include <string>

namespace dexcheck {

/// A text in quotes where a comma, a quote or a line's end needs them. One that a spreadsheet would take for
/// a formula gets an apostrophe, which makes it a text there.
std::string QuoteField(const std::string& text);

}  // namespace dexcheck
