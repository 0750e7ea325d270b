#pragma once

// JSON that others wrote: its values are printed, copied and freed by recursion, so that its depth is
// bounded.

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace dexcheck {

/// Brackets inside each other that a text may have; what is read here has at most eight.
inline constexpr int kMostBrackets = 32;

/// Whether more brackets are open at a place of the text, outside of its strings.
inline bool IsNestedTooDeep(std::string_view json) {
  int depth = 0;
  bool is_in_string = false;
  for (size_t i = 0; i < json.size() && depth <= kMostBrackets; ++i) {
    const char c = json[i];
    if (c == '"') is_in_string = !is_in_string;
    if (is_in_string && c == '\\') ++i;
    if (is_in_string) continue;
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
  }
  return depth > kMostBrackets;
}

/// The library's message without the "[json.exception.NAME.NUMBER] " that it begins with.
inline std::string DescribeJsonError(const nlohmann::json::exception& error) {
  const std::string message = error.what();
  const size_t tag = message.find("] ");
  return tag == std::string::npos ? message : message.substr(tag + 2);
}

/// JSON as the text of a file, which ends in a new line. Bytes that are no UTF-8, such as those of a file's
/// name, are replaced.
template <typename Json>
std::string FormatJson(const Json& json, int indent = 2) {
  return json.dump(indent, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace) + "\n";
}

/// The value of a text; discarded when the text is no JSON or is nested too deeply.
template <typename Json = nlohmann::json>
Json ParseJson(std::string_view text) {
  if (IsNestedTooDeep(text)) return Json(nlohmann::detail::value_t::discarded);
  return Json::parse(text, nullptr, /*allow_exceptions=*/false);
}

/// The text at a place, "/attribution/cause"; empty where there is none.
template <typename Json>
std::string FindText(const Json& json, const char* place) {
  const typename Json::json_pointer pointer(place);
  return json.contains(pointer) && json.at(pointer).is_string() ? json.at(pointer).template get<std::string>()
                                                                : "";
}

}  // namespace dexcheck
