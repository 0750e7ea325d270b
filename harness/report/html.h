#pragma once

// Pieces of HTML text.

#include <string>
#include <string_view>

namespace dexcheck {

/// The text with HTML's special characters escaped, for content and quoted attributes.
std::string EscapeHtml(std::string_view text);

std::string EncodeBase64(std::string_view bytes);

/// "2.6e-15", "0", "infinite".
std::string FormatShort(double value);

/// "4.5 %", "0", "over 1000 x": a check's value as a share of its bound.
std::string FormatShare(double share);

/// What gnuplot wrote as SVG, ready to stand in a page: without prolog, definitions and ids.
std::string MakeInlineSvg(std::string svg, const std::string& title);

}  // namespace dexcheck
