#include "harness/report/page_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
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

namespace {

constexpr const char* kContentPolicy =
    "default-src 'none'; img-src data:; media-src data:; style-src 'unsafe-inline'; script-src "
    "'unsafe-inline'";

std::string EscapeTitle(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '&' ? "&amp;" : c == '<' ? "&lt;" : std::string(1, c);
  return escaped;
}

static_assert(std::endian::native == std::endian::little, "browsers read the numbers in this order");

/// Most numbers of all plots together: about 3 MB of base64.
constexpr long kMostNumbers = 560'000;
constexpr long kFewestPoints = 1000;

/// Times in microseconds' resolution, which keeps their text short.
double RoundTime(double time) { return std::round(1e6 * time) / 1e6; }

}  // namespace

std::string AssemblePage(const PageParts& parts) {
  std::string page = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  page += fmt::format(
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n<title>{} – dexcheck</title>\n"
      "<link rel=\"icon\" href=\"data:,\">\n<style>\n{}{}</style>\n</head>\n<body>\n",
      kContentPolicy, EscapeTitle(parts.title), kPageCss, fmt::join(parts.styles, ""));
  page += fmt::format("{}{}", fmt::join(parts.markup, ""), parts.data);
  page += fmt::format("<script>\n{}\n</script>\n", kDomJs);
  for (const char* script : parts.scripts) page += fmt::format("<script>\n{}\n</script>\n", script);
  return page + "</body>\n</html>\n";
}

std::string AssemblePlotPage(const std::string& title, const char* script, const std::string& data,
                             std::span<const PlotGroup> groups, const ReplayData* replay) {
  PageParts parts{.title = title,
                  .markup = {kPageHtml},
                  .data = data + EmbedPlots(groups),
                  .scripts = {script, kChartJs, kChartsJs, kPageJs}};
  if (replay != nullptr) {
    parts.markup.push_back(kReplayHtml);
    parts.data += EmbedJson("replay-scene", replay->json) + EmbedBytes("replay-values", replay->values);
    parts.scripts.insert(parts.scripts.end(), {kThreeJs, kReplayJs});
  }
  return AssemblePage(parts);
}

std::string EmbedPlots(std::span<const PlotGroup> groups) {
  long curves = 0;
  for (const PlotGroup& group : groups)
    for (const Figure& figure : group.figures) curves += static_cast<long>(figure.curves.size());
  const long most = std::max(kMostNumbers / std::max(curves, 1L), kFewestPoints);
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  std::string bytes;
  for (const PlotGroup& group : groups) {
    const Thinning thinning(group.time, most);
    nlohmann::ordered_json& one = json.emplace_back();
    one["title"] = group.title;
    one["times"] = nlohmann::ordered_json::array();
    for (const double t : thinning.times()) one["times"].push_back(RoundTime(t));
    one["plots"] = nlohmann::ordered_json::array();
    for (const Figure& figure : group.figures) {
      nlohmann::ordered_json plot = {
          {"name", figure.name},   {"panel", figure.panel},     {"title", figure.title},
          {"note", figure.note},   {"label", figure.label},     {"right", figure.right_label},
          {"log", figure.log},     {"bound", nullptr},          {"band", nullptr},
          {"below", figure.below}, {"answers", figure.answers}, {"range", CalcAxisRange(figure, false)}};
      if (!figure.right_label.empty()) plot["right_range"] = CalcAxisRange(figure, true);
      if (figure.bound) plot["bound"] = *figure.bound;
      if (figure.band) plot["band"] = *figure.band;
      for (const Curve& curve : figure.curves) {
        plot["curves"].push_back({{"label", curve.label},
                                  {"color", FindColor(curve.color)},
                                  {"background", curve.color == kGrey},
                                  {"dashes", FindDashes(curve.dash)},
                                  {"right", curve.right_axis},
                                  {"wide", curve.wide},
                                  {"begin", bytes.size() / sizeof(float)}});
        for (const double value : thinning.Apply(curve.values)) {
          const auto number = std::bit_cast<std::array<char, 4>>(static_cast<float>(value));
          bytes.append(number.data(), number.size());
        }
      }
      one["plots"].push_back(plot);
    }
  }
  return EmbedJson("run-plots", json) + EmbedBytes("run-values", bytes);
}

}  // namespace dexcheck
