#include "harness/report/page_plots.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "harness/report/page_text.h"
#include "harness/report/thinning.h"

namespace dexcheck {
namespace {

static_assert(std::endian::native == std::endian::little, "browsers read the numbers in this order");

/// Of all plots together: about 3 MB of base64.
constexpr long kMostNumbers = 560'000;
constexpr long kFewestPoints = 1000;

/// Times in microseconds' resolution, which keeps their text short.
double RoundTime(double time) { return std::round(1e6 * time) / 1e6; }

}  // namespace

std::string EmbedPlots(const std::vector<Figure>& figures, const VectorXd& time) {
  long curves = 0;
  for (const Figure& figure : figures) curves += static_cast<long>(figure.curves.size());
  const Thinning thinning(time, std::max(kMostNumbers / std::max(curves, 1L), kFewestPoints));
  nlohmann::ordered_json json;
  std::string bytes;
  for (const double t : thinning.times()) json["times"].push_back(RoundTime(t));
  json["points"] = thinning.times().size();
  json["plots"] = nlohmann::ordered_json::array();
  int series = 0;
  for (const Figure& figure : figures) {
    nlohmann::ordered_json plot = {
        {"name", figure.name}, {"panel", figure.panel}, {"title", figure.title},
        {"note", figure.note}, {"label", figure.label}, {"right", figure.right_label},
        {"log", figure.log},   {"bound", nullptr},      {"range", CalcAxisRange(figure, false)}};
    if (!figure.right_label.empty()) plot["right_range"] = CalcAxisRange(figure, true);
    if (figure.bound) plot["bound"] = *figure.bound;
    for (const Curve& curve : figure.curves) {
      plot["curves"].push_back({{"id", "s" + std::to_string(series)},
                                {"label", curve.label},
                                {"color", FindColor(curve.color)},
                                {"background", curve.color == kGrey},
                                {"dashes", FindDashes(curve.dash)},
                                {"right", curve.right_axis},
                                {"wide", curve.wide},
                                {"series", series}});
      ++series;
      for (const double value : thinning.Apply(curve.values)) {
        const auto number = std::bit_cast<std::array<char, 4>>(static_cast<float>(value));
        bytes.append(number.data(), number.size());
      }
    }
    json["plots"].push_back(plot);
  }
  return EmbedJson("run-plots", json) + EmbedBytes("run-values", bytes);
}

}  // namespace dexcheck
