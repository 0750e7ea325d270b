#include "harness/study/study_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/report/html.h"

namespace dexcheck {
namespace {

constexpr double kWidth = 560.0;
constexpr double kHeight = 420.0;
constexpr double kLeft = 70.0;
constexpr double kRight = 15.0;
constexpr double kTop = 30.0;
constexpr double kBottom = 50.0;
constexpr double kInnerWidth = kWidth - kLeft - kRight;
constexpr double kInnerHeight = kHeight - kTop - kBottom;
constexpr double kDecades = 30.0;  // ratio from which a logarithm shows more

double Scale(double value, bool logarithmic) { return logarithmic ? std::log(value) : value; }

/// Where a value lies among the middles of the cells: 0 is the first cell's, n - 1 the last's.
double FindPlace(const Axis& axis, double value) {
  const std::vector<double>& v = axis.values;
  if (v.size() < 2) return 0.0;
  size_t i = 0;
  while (i + 2 < v.size() && value > v[i + 1]) ++i;
  const double from = Scale(v[i], axis.logarithmic);
  const double to = Scale(v[i + 1], axis.logarithmic);
  return static_cast<double>(i) + (Scale(value, axis.logarithmic) - from) / (to - from);
}

std::string Open(const std::string& title) {
  return fmt::format(
      "<figure><svg viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" role=\"img\">\n<title>{}</title>\n"
      "<text x=\"{}\" y=\"18\" class=\"title\">{}</text>\n",
      kWidth, kHeight, kWidth, kHeight, EscapeHtml(title), kLeft, EscapeHtml(title));
}

std::string DrawLabels(const Axis& x, const Axis& y) {
  return fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n"
      "<text transform=\"translate(14 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      kLeft + 0.5 * kInnerWidth, kHeight - 10.0, EscapeHtml(x.label), kTop + 0.5 * kInnerHeight,
      EscapeHtml(y.label));
}

std::string DrawTick(bool horizontal, double at, double value) {
  if (horizontal) {
    return fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"tick\">{:.3g}</text>\n", at,
        kTop + kInnerHeight + 16.0, value);
  }
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\" class=\"tick\">{:.3g}</text>\n",
                     kLeft - 6.0, at + 4.0, value);
}

std::string Link(const std::string& link, const std::string& title, const std::string& shape) {
  const std::string inner =
      fmt::format("{}<title>{}</title></{}>", shape, EscapeHtml(title), shape.substr(1, shape.find(' ') - 1));
  return link.empty() ? inner + "\n" : fmt::format("<a href=\"{}\">{}</a>\n", EscapeHtml(link), inner);
}

std::string DrawEdge(double x1, double y1, double x2, double y2) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" class=\"edge\"/>\n", x1,
                     y1, x2, y2);
}

/// Ends of an axis that hold all values, with a little room.
void Fit(Axis* axis, const std::vector<double>& values) {
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  if (!(least <= most)) least = most = 1.0;
  axis->logarithmic = least > 0.0 && most / least > kDecades;
  const double from = Scale(least, axis->logarithmic);
  const double to = Scale(most, axis->logarithmic);
  const double room = to > from ? 0.04 * (to - from) : 0.5 * std::max(std::abs(from), 1e-300);
  axis->values = {from - room, to + room};
  if (axis->logarithmic) axis->values = {std::exp(from - room), std::exp(to + room)};
}

}  // namespace

std::string ColorOf(double value, double least, double most) {
  if (!std::isfinite(value)) return "#e8e8e8";
  const bool logarithmic = least > 0.0 && most / least > kDecades;
  const double from = Scale(least, logarithmic);
  const double to = Scale(most, logarithmic);
  const double share =
      to > from ? std::clamp((Scale(value, logarithmic) - from) / (to - from), 0.0, 1.0) : 0.0;
  // From pale yellow over green to dark blue.
  const auto mix = [&](double a, double b, double c) {
    const double v = share < 0.5 ? a + 2.0 * share * (b - a) : b + (2.0 * share - 1.0) * (c - b);
    return static_cast<int>(std::lround(v));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", mix(255, 65, 8), mix(255, 182, 29), mix(204, 196, 88));
}

std::string DrawHeatMap(const HeatMap& map) {
  const size_t columns = map.x.values.size();
  const size_t rows = map.y.values.size();
  const double w = kInnerWidth / static_cast<double>(columns);
  const double h = kInnerHeight / static_cast<double>(rows);
  const auto left = [&](double column) { return kLeft + w * column; };
  const auto top = [&](double row) { return kTop + kInnerHeight - h * (row + 1.0); };
  std::string svg = Open(map.title);
  std::string edges;
  for (size_t j = 0; j < rows; ++j) {
    for (size_t i = 0; i < columns; ++i) {
      const HeatCell& cell = map.cells[j * columns + i];
      if (cell.color.empty()) continue;
      const double x = left(static_cast<double>(i));
      const double y = top(static_cast<double>(j));
      svg +=
          Link(cell.link, cell.title,
               fmt::format("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"{}\">",
                           x, y, w, h, cell.color));
      const auto differs = [&](size_t other) {
        return map.with_boundary && !map.cells[other].color.empty() && map.cells[other].held != cell.held;
      };
      if (i + 1 < columns && differs(j * columns + i + 1)) edges += DrawEdge(x + w, y, x + w, y + h);
      if (j + 1 < rows && differs((j + 1) * columns + i)) edges += DrawEdge(x, y, x + w, y);
    }
  }
  svg += edges;
  for (const auto& [color, points] : map.overlays) {
    for (const auto& [x, y] : points) {
      svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2\" fill=\"{}\"/>\n",
                         left(FindPlace(map.x, x) + 0.5), top(FindPlace(map.y, y) - 0.5), color);
    }
  }
  constexpr size_t kMostTicks = 8;
  for (size_t i = 0; i < columns; i += (columns + kMostTicks - 1) / kMostTicks) {
    svg += DrawTick(true, left(static_cast<double>(i) + 0.5), map.x.values[i]);
  }
  for (size_t j = 0; j < rows; j += (rows + kMostTicks - 1) / kMostTicks) {
    svg += DrawTick(false, top(static_cast<double>(j) - 0.5), map.y.values[j]);
  }
  return svg + DrawLabels(map.x, map.y) + "</svg></figure>\n";
}

std::string DrawChart(Chart chart) {
  std::vector<double> xs;
  std::vector<double> ys;
  for (const ChartPoint& point : chart.points) {
    xs.push_back(point.x);
    ys.push_back(point.y);
  }
  for (const ChartLine& line : chart.lines) {
    for (const auto& [x, y] : line.points) {
      xs.push_back(x);
      ys.push_back(y);
    }
  }
  Fit(&chart.x, xs);
  Fit(&chart.y, ys);
  const auto place_x = [&](double x) { return kLeft + kInnerWidth * FindPlace(chart.x, x); };
  const auto place_y = [&](double y) { return kTop + kInnerHeight * (1.0 - FindPlace(chart.y, y)); };
  std::string svg = Open(chart.title);
  svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" class=\"frame\"/>\n", kLeft, kTop,
                     kInnerWidth, kInnerHeight);
  constexpr int kTicks = 5;
  const auto tick = [](const Axis& axis, double share) {
    const double from = Scale(axis.values[0], axis.logarithmic);
    const double at = from + share * (Scale(axis.values[1], axis.logarithmic) - from);
    return axis.logarithmic ? std::exp(at) : at;
  };
  for (int i = 0; i <= kTicks; ++i) {
    const double share = static_cast<double>(i) / kTicks;
    svg += DrawTick(true, kLeft + share * kInnerWidth, tick(chart.x, share));
    svg += DrawTick(false, kTop + (1.0 - share) * kInnerHeight, tick(chart.y, share));
  }
  double legend = kTop + 14.0;
  for (const ChartLine& line : chart.lines) {
    std::string points;
    for (const auto& [x, y] : line.points) {
      if (std::isfinite(y)) points += fmt::format("{:.1f},{:.1f} ", place_x(x), place_y(y));
    }
    svg += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", points,
                       line.color);
    if (line.label.empty()) continue;
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\" fill=\"{}\">{}</text>\n",
                       kLeft + kInnerWidth - 6.0, legend, line.color, EscapeHtml(line.label));
    legend += 15.0;
  }
  for (const ChartPoint& point : chart.points) {
    if (!std::isfinite(point.x) || !std::isfinite(point.y)) continue;
    svg += Link(point.link, point.title,
                fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\">", place_x(point.x),
                            place_y(point.y), point.color));
  }
  return svg + DrawLabels(chart.x, chart.y) + "</svg></figure>\n";
}

}  // namespace dexcheck
