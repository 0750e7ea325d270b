#pragma once

// HTML that is made of markup and text. They have different types, so that text cannot get into a page
// without being escaped.

#include <fmt/format.h>

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace dexcheck {

/// Markup that stands in the source code.
class HtmlLiteral {
 public:
  // Only what the compiler knows. NOLINTNEXTLINE(google-explicit-constructor)
  consteval HtmlLiteral(const char* markup) : markup_(markup) {}
  [[nodiscard]] std::string_view markup() const { return markup_; }

 private:
  std::string_view markup_;
};

/// Markup, with the texts that were put into it escaped. Made by FormatHtml and from literals; Raw alone lets
/// other text pass as it is.
class Html {
 public:
  Html() = default;
  // NOLINTNEXTLINE(google-explicit-constructor)
  Html(const HtmlLiteral& literal) : markup_(literal.markup()) {}
  /// @param markup is markup already, and no text from files.
  static Html Raw(std::string markup) {
    Html html;
    html.markup_ = std::move(markup);
    return html;
  }
  /// The text with HTML's special characters escaped, for content and quoted attributes.
  static Html Text(std::string_view text);

  Html& operator+=(const Html& more) {
    markup_ += more.markup_;
    return *this;
  }
  Html& operator+=(const HtmlLiteral& more) {
    markup_ += more.markup();
    return *this;
  }

  [[nodiscard]] bool empty() const { return markup_.empty(); }
  [[nodiscard]] const std::string& markup() const { return markup_; }

 private:
  std::string markup_;
};

namespace html_detail {

inline const std::string& Show(const Html& html) { return html.markup(); }
inline std::string Show(std::string_view text) { return Html::Text(text).markup(); }
template <typename Number>
requires std::is_arithmetic_v<Number> Number Show(Number number) { return number; }
template <typename Argument>
using Shown = std::remove_cvref_t<decltype(Show(std::declval<const Argument&>()))>;

}  // namespace html_detail

/// As fmt::format. Texts among the arguments are escaped, numbers and Html stand as they are.
template <typename... Arguments>
Html FormatHtml(fmt::format_string<html_detail::Shown<Arguments>...> format, const Arguments&... arguments) {
  return Html::Raw(fmt::format(format, html_detail::Shown<Arguments>(html_detail::Show(arguments))...));
}

std::string EncodeBase64(std::string_view bytes);

/// A script element that holds data. Text that is no UTF-8 is mended, and nothing in it can end the element.
Html EmbedJson(const std::string& id, const nlohmann::ordered_json& json);

/// A script element that holds bytes as base64.
Html EmbedBytes(const std::string& id, std::string_view bytes);

/// "2.6e-15", "0", "infinite".
std::string FormatShort(double value);

/// "4.5 %", "0", "over 1000 x": a check's value as a fraction of its bound.
std::string FormatFraction(double fraction);

}  // namespace dexcheck
