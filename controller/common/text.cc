#include "controller/common/text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace dexcheck {
namespace {

constexpr size_t kMaxShown = 120;

/// Levenshtein's distance: fewest insertions, deletions and replacements of letters that turn a into b.
size_t CalcEditDistance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 0; i < a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i + 1;
    for (size_t j = 0; j < b.size(); ++j) {
      const size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, replaced});
    }
  }
  return row[b.size()];
}

/// Bytes of the character of UTF-8 that begins the text; 0 when there is none.
size_t CountUtf8(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  const size_t length = first < 0x80   ? 1
                        : first < 0xc2 ? 0
                        : first < 0xe0 ? 2
                        : first < 0xf0 ? 3
                        : first < 0xf5 ? 4
                                       : 0;
  if (length > text.size()) return 0;
  for (size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0U) != 0x80) return 0;
  }
  const bool is_no_character = (first == 0xe0 && byte(1) < 0xa0) || (first == 0xed && byte(1) > 0x9f) ||
                               (first == 0xf0 && byte(1) < 0x90) || (first == 0xf4 && byte(1) > 0x8f);
  return is_no_character ? 0 : length;
}

}  // namespace

std::string FormatNumber(double value) {
  if (std::isnan(value)) return "nan";  // Of either sign.
  std::array<char, 32> buffer{};
  const std::to_chars_result result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

std::string FormatNumber(double value, int digits) {
  if (std::isnan(value)) return "nan";
  std::array<char, 32> buffer{};
  const std::to_chars_result result =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, digits);
  return {buffer.data(), result.ptr};
}

std::string MendUtf8(std::string_view text) {
  std::string mended;
  while (!text.empty()) {
    const size_t length = CountUtf8(text);
    mended += length > 0 ? text.substr(0, length) : "?";
    text.remove_prefix(std::max<size_t>(length, 1));
  }
  return mended;
}

std::string Abbreviate(std::string_view text) {
  size_t end = std::min(text.size(), kMaxShown);
  const auto continues = [&](size_t i) { return (static_cast<unsigned char>(text[i]) & 0xc0U) == 0x80U; };
  while (end < text.size() && end > 0 && continues(end)) --end;  // Never inside a UTF-8 sequence.
  std::string shown(text.substr(0, end));
  std::replace_if(
      shown.begin(), shown.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return end < text.size() ? shown + "..." : shown;
}

std::string Quote(std::string_view text) { return '"' + Abbreviate(text) + '"'; }

std::string JoinNames(const std::vector<std::string>& names) {
  constexpr size_t kMaxShown = 8;
  std::string text;
  for (size_t i = 0; i < std::min(names.size(), kMaxShown); ++i) text += (i == 0 ? "" : ", ") + names[i];
  text = Abbreviate(text);
  if (names.size() > kMaxShown) text += " and " + std::to_string(names.size() - kMaxShown) + " more";
  return text;
}

std::string QuoteField(const std::string& text) {
  const bool is_formula = text.find_first_of("=+-@\t\r") == 0;
  if (!is_formula && text.find_first_of(",;\t\"\n\r") == std::string::npos) return text;
  std::string quoted = is_formula ? "\"'" : "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string FindNearest(std::string_view word, const std::vector<std::string>& candidates) {
  std::string nearest;
  size_t smallest = word.size() + 1;
  for (const std::string& candidate : candidates) {
    const auto [shorter, longer] = std::minmax({word.size(), candidate.size()});
    const size_t close = longer / 3;
    if (longer - shorter > close) continue;
    const size_t distance = CalcEditDistance(word, candidate);
    if (distance <= close && distance < smallest) {
      smallest = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

std::string SuggestNearest(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string nearest = FindNearest(word, candidates);
  return nearest.empty() ? "" : ", did you mean " + Quote(nearest) + "?";
}

std::string SuggestInBrackets(std::string_view word, const std::vector<std::string>& candidates,
                              std::string_view lead) {
  const std::string nearest = FindNearest(word, candidates);
  return nearest.empty() ? "" : " (" + std::string(lead) + Quote(nearest) + "?)";
}

std::string_view Trim(std::string_view text, std::string_view blanks) {
  const size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

std::string ToLower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char letter) {
    return 'A' <= letter && letter <= 'Z' ? char(letter - 'A' + 'a') : letter;
  });
  return text;
}

}  // namespace dexcheck
