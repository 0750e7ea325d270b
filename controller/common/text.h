#pragma once

// Text for messages.

#include <array>
#include <charconv>
#include <string>
#include <string_view>

namespace dexcheck {

/// Shortest decimal text that reads back as the same number.
inline std::string FormatNumber(double value) {
  std::array<char, 32> buffer{};
  const std::to_chars_result result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

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

/// The text in double quotes.
inline std::string Quote(std::string_view text) { return '"' + std::string(text) + '"'; }

}  // namespace dexcheck
