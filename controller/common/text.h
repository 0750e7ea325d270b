#pragma once

// Text for messages.

#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace dexcheck {

/// Shortest decimal text that reads back as the same number.
std::string FormatNumber(double value);
/// Shortest decimal text of the number rounded to at most this many significant digits.
std::string FormatNumber(double value, int digits);

/// "[a, b, c]" of any range of numbers.
template <typename Range>
std::string FormatNumbers(const Range& values) {
  std::string text = "[";
  for (const double value : values) {
    if (text.size() > 1) text += ", ";
    text += FormatNumber(value);
  }
  return text + "]";
}

/// The text with '?' for each byte that is no UTF-8.
std::string MendUtf8(std::string_view text);

/// The text on one line of bounded length: control characters become '?', a long text ends in "...".
std::string Abbreviate(std::string_view text);

/// The abbreviated text in double quotes.
std::string Quote(std::string_view text);

/// "a, b, c" on one line: the first few names, and how many more.
std::string JoinNames(const std::vector<std::string>& names);

/// A value of a table of comma-separated ones: in quotes where a comma, a quote or a line's end needs them.
/// One that a spreadsheet would take for a formula gets an apostrophe, which makes it a text there.
std::string QuoteField(const std::string& text);

/// The candidate closest to a misspelt word by edit distance; empty when none is close (a third of the
/// letters).
std::string FindNearest(std::string_view word, const std::vector<std::string>& candidates);
/// ", did you mean "WORD"?" of that candidate; empty when none is close.
std::string SuggestNearest(std::string_view word, const std::vector<std::string>& candidates);
/// " (did you mean "WORD"?)", or with another `lead`; empty when none is close.
std::string SuggestInBrackets(std::string_view word, const std::vector<std::string>& candidates,
                              std::string_view lead = "did you mean ");

/// The text without these letters before and behind it.
std::string_view Trim(std::string_view text, std::string_view blanks = " \t\r");
/// The text in lower case; only ASCII letters change.
std::string ToLower(std::string text);

/// The number that the whole text is; none when it is not one, or does not fit.
template <typename Number>
std::optional<Number> ParseNumber(std::string_view text) {
  Number number{};
  const std::from_chars_result result = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_whole = result.ec == std::errc() && result.ptr == text.data() + text.size();
  return is_whole ? std::optional(number) : std::nullopt;
}

}  // namespace dexcheck
