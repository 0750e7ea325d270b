#pragma once

// A study's rows for other programs.

#include <functional>
#include <string>
#include <string_view>

#include "harness/study/study_store.h"

namespace dexcheck {

/// A text in quotes where a comma, a quote or a line's end needs them. One that a spreadsheet would take for
/// a formula gets an apostrophe, which makes it a text there.
std::string QuoteField(const std::string& text);

/// Comma-separated values with a head: trial, seed, the keys, outcome, failure, the metrics, machine. Numbers
/// read back as the same doubles; what does not exist is empty.
/// @param write takes the text piece by piece.
void WriteStudyCsv(const StudyStore& store, const std::function<void(std::string_view)>& write);

}  // namespace dexcheck
