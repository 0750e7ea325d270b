#include "harness/report/page_text.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

namespace dexcheck {

std::string EncodeBase64(std::string_view bytes) {
  static constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k) {
      group = group << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (size_t k = 0; k < 4; ++k) {
      text += i + k > bytes.size() ? '=' : kDigits[group >> (18U - 6U * k) & 63U];
    }
  }
  return text;
}

// Outside strings JSON has no "<", and in them it may be written so.
std::string EmbedJson(const std::string& id, const nlohmann::ordered_json& json) {
  std::string text = json.dump(-1, ' ', /*ensure_ascii=*/false, nlohmann::json::error_handler_t::replace);
  for (size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at))
    text.replace(at, 1, "\\u003c");
  return fmt::format("<script type=\"application/json\" id=\"{}\">{}</script>\n", id, text);
}

std::string EmbedBytes(const std::string& id, std::string_view bytes) {
  return fmt::format("<script type=\"text/plain\" id=\"{}\">{}</script>\n", id, EncodeBase64(bytes));
}

std::string FormatShort(double value) {
  if (!std::isfinite(value)) return "infinite";
  if (value == 0.0) return "0";
  const double size = std::abs(value);
  return size >= 0.01 && size < 1e4 ? fmt::format("{:.3g}", value) : fmt::format("{:.1e}", value);
}

std::string FormatFraction(double fraction) {
  if (!std::isfinite(fraction)) return "beyond any bound";
  if (fraction == 0.0) return "0";
  if (fraction > 10.0) return FormatShort(fraction) + " ×";
  const double percent = 100.0 * fraction;
  if (percent < 0.01) return "< 0.01 %";
  // Two digits, but 99.7 % is not yet the whole bound, and 150 % is no power of ten.
  if (percent >= 99.5) return fmt::format("{:.{}f} %", percent, percent < 100.0 ? 1 : 0);
  return fmt::format("{:.2g} %", percent);
}

}  // namespace dexcheck
