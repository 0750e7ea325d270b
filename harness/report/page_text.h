#pragma once

// Data and texts of pages. A page's script makes its elements of them, so that no text can become markup.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace dexcheck {

std::string EncodeBase64(std::string_view bytes);

/// A script element that holds data. Text that is no UTF-8 is mended, and nothing in it can end the element.
/// @param id markup already.
std::string EmbedJson(const std::string& id, const nlohmann::ordered_json& json);

/// A script element that holds bytes as base64.
std::string EmbedBytes(const std::string& id, std::string_view bytes);

/// "2.6e-15", "0", "infinite".
std::string FormatShort(double value);

/// "4.5 %", "0", "over 1000 x": a check's value as a fraction of its bound.
std::string FormatFraction(double fraction);

}  // namespace dexcheck
