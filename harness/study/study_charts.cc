#include "harness/study/study_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "harness/base/files.h"
#include "harness/report/html.h"
#include "renders/picture_file.h"

namespace dexcheck {
namespace {

constexpr double kHeight = 420.0;
constexpr double kInnerWidth = 435.0;
constexpr double kLeft = 86.0;
constexpr double kRight = 15.0;
constexpr double kScaleRoom = 60.0;  // for a scale of colours
constexpr double kTop = 30.0;
constexpr double kBottom = 50.0;
constexpr double kWidth = kLeft + kInnerWidth + kRight;
constexpr double kKeyRow = 17.0;
constexpr double kInnerHeight = kHeight - kTop - kBottom;
constexpr double kDecades = 30.0;  // ratio from which a logarithm shows more

/// Whether a logarithm shows more.
bool IsWide(double least, double most) { return least > 0.0 && most / least > kDecades; }

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

Html Open(const std::string& title, double width, double height) {
  return FormatHtml(
      "<figure class=\"card\"><svg viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" "
      "role=\"img\">\n<title>{}</title>\n"
      "<text x=\"{}\" y=\"18\" class=\"title\">{}</text>\n",
      width, height, width, height, title, kLeft, title);
}

Html DrawLabels(const Axis& x, const Axis& y) {
  return FormatHtml(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n"
      "<text transform=\"translate(13 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      kLeft + 0.5 * kInnerWidth, kHeight - 10.0, x.label, kTop + 0.5 * kInnerHeight, y.label);
}

constexpr int kRoundDigits = 6;  // enough for values that are round

/// "0.02", "3e-7".
std::string FormatTick(double value, int digits) {
  if (value == 0.0) return "0";
  std::string text = fmt::format("{:.{}g}", value, digits);
  const size_t exponent = text.find('e');
  if (exponent == std::string::npos) return text;
  return fmt::format("{}e{}", text.substr(0, exponent), std::stoi(text.substr(exponent + 1)));
}

/// Round values between two ends, some four to eight.
std::vector<double> ListRoundValues(double from, double to, bool logarithmic) {
  std::vector<double> ticks;
  if (logarithmic && to / from >= 10.0) {
    const int first = static_cast<int>(std::floor(std::log10(from)));
    const int last = static_cast<int>(std::ceil(std::log10(to)));
    const int every = (last - first + 7) / 8;
    for (int decade = first; decade <= last; decade += every) {
      for (const double digit : {1.0, 2.0, 5.0}) {
        const double value = digit * std::pow(10.0, decade);
        if ((digit == 1.0 || last - first <= 2) && value >= from && value <= to) ticks.push_back(value);
      }
    }
    return ticks;
  }
  const double rough = (to - from) / 5.0;
  if (!(rough > 1e-12 * std::max(std::abs(from), std::abs(to)))) return {from};
  const double decade = std::pow(10.0, std::floor(std::log10(rough)));
  const double digit = rough / decade;
  const double step = decade * (digit > 7.0 ? 10.0 : digit > 3.5 ? 5.0 : digit > 1.5 ? 2.0 : 1.0);
  for (double k = std::ceil(from / step - 1e-9); k * step <= to + 1e-9 * step; ++k) ticks.push_back(k * step);
  return ticks;
}

/// A text in two lines, broken behind the sign nearest its middle, when it is wider than its room.
std::vector<std::string> BreakLabel(const std::string& label, double room) {
  constexpr double kLetter = 6.6;  // mean width of a letter of class "tick", a little more than measured
  if (kLetter * static_cast<double>(label.size()) <= room) return {label};
  const auto distance = [&](size_t at) {
    return std::abs(2.0 * static_cast<double>(at + 1) - static_cast<double>(label.size()));
  };
  size_t best = std::string::npos;
  for (size_t at = label.find_first_of("_ .,-"); at != std::string::npos;
       at = label.find_first_of("_ .,-", at + 1)) {
    if (at + 1 < label.size() && (best == std::string::npos || distance(at) < distance(best))) best = at;
  }
  if (best == std::string::npos) return {label};
  return {label.substr(0, best + 1), label.substr(best + 1)};
}

/// @param room between two ticks' texts, in which one that stands below the chart is to find place.
Html DrawTick(bool horizontal, double at, const std::string& label, double room = kInnerWidth) {
  if (horizontal) {
    constexpr double kLine = 11.0;
    Html svg =
        FormatHtml("<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\" class=\"mark\"/>", at,
                   kTop + kInnerHeight, kTop + kInnerHeight + 4.0);
    double y = kTop + kInnerHeight + 17.0;
    for (const std::string& line : BreakLabel(label, room)) {
      svg += FormatHtml("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"tick\">{}</text>\n",
                        at, y, line);
      y += kLine;
    }
    return svg;
  }
  return FormatHtml(
      "<line x1=\"{0:.1f}\" x2=\"{1:.1f}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" class=\"mark\"/>"
      "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"end\" class=\"tick\">{5}</text>\n",
      kLeft - 4.0, kLeft, at, kLeft - 7.0, at + 4.0, label);
}

/// A shape, shown with a title when pointed at, that leads somewhere.
/// @param tag of the shape, "rect".
Html Link(const std::string& link, const std::string& title, const char* tag, const Html& attributes) {
  const Html inner = FormatHtml("<{0} {1}><title>{2}</title></{0}>", tag, attributes, title);
  return link.empty() ? FormatHtml("{}\n", inner) : FormatHtml("<a href=\"{}\">{}</a>\n", link, inner);
}

Html DrawEdge(double x1, double y1, double x2, double y2) {
  return FormatHtml("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" class=\"edge\"/>\n", x1,
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
  axis->logarithmic = IsWide(least, most);
  const double from = Scale(least, axis->logarithmic);
  const double to = Scale(most, axis->logarithmic);
  const double room = to > from ? 0.04 * (to - from) : 0.5 * std::max(std::abs(from), 1e-300);
  axis->values = {from - room, to + room};
  if (axis->logarithmic) axis->values = {std::exp(from - room), std::exp(to + room)};
}

/// 0, 1, ..: the values that have labels.
std::vector<double> ListLabelled(const Axis& axis) {
  std::vector<double> values;
  for (size_t i = 0; i < axis.labels.size(); ++i) values.push_back(static_cast<double>(i));
  return values;
}

std::string LabelTick(const Axis& axis, double value, int digits) {
  return axis.labels.empty() ? FormatTick(value, digits) : axis.labels.at(static_cast<size_t>(value));
}

/// All values of a few cells, round ones of many.
std::vector<double> ListCellTicks(const Axis& axis) {
  if (!axis.labels.empty()) return ListLabelled(axis);
  constexpr size_t kMostCells = 13;
  if (axis.values.size() <= kMostCells) return axis.values;
  return ListRoundValues(axis.values.front(), axis.values.back(), axis.logarithmic);
}

/// Colours from the least value to the most, right of the map.
Html DrawScale(double least, double most) {
  constexpr int kSteps = 40;
  constexpr double kLeftEdge = kLeft + kInnerWidth + 14.0;
  constexpr double kBarWidth = 12.0;
  const bool logarithmic = IsWide(least, most);
  const double from = Scale(least, logarithmic);
  const double to = Scale(most, logarithmic);
  const auto place = [&](double value) {
    return kTop + kInnerHeight * (to > from ? (to - Scale(value, logarithmic)) / (to - from) : 0.5);
  };
  Html svg;
  for (int i = 0; i < kSteps; ++i) {
    const double at = from + (i + 0.5) / kSteps * (to - from);
    const double height = kInnerHeight / kSteps;
    svg += FormatHtml("<rect x=\"{:.1f}\" y=\"{:.2f}\" width=\"{}\" height=\"{:.2f}\" fill=\"{}\"/>\n",
                      kLeftEdge, kTop + kInnerHeight - (i + 1) * height, kBarWidth, height + 0.3,
                      ColorOf(logarithmic ? std::exp(at) : at, least, most));
  }
  const auto label = [&](double value) {
    return FormatHtml("<text x=\"{:.1f}\" y=\"{:.1f}\" class=\"tick\">{}</text>\n",
                      kLeftEdge + kBarWidth + 4.0, place(value) + 4.0, FormatTick(value, kRoundDigits));
  };
  if (!(to > from)) {
    svg += label(least);
    return svg;
  }
  for (const double value : ListRoundValues(least, most, logarithmic)) svg += label(value);
  return svg;
}

constexpr int kKeyColumns = 2;

/// Below the chart.
Html DrawKey(int number, const ChartLine& line) {
  const double x = kLeft + kInnerWidth / kKeyColumns * (number % kKeyColumns);
  const int row = number / kKeyColumns;
  const double y = kHeight + kKeyRow * row + 4.0;
  return FormatHtml(
      "<line x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"2.5\"/>"
      "<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
      x, x + 18.0, y, y, line.color, x + 24.0, y + 4.0, line.label);
}

}  // namespace

std::string ColorOf(double value, double least, double most) {
  if (!std::isfinite(value)) return "#e8e8e8";
  const bool logarithmic = IsWide(least, most);
  const double from = Scale(least, logarithmic);
  const double to = Scale(most, logarithmic);
  const double fraction =
      to > from ? std::clamp((Scale(value, logarithmic) - from) / (to - from), 0.0, 1.0) : 0.0;
  // From pale yellow over green to dark blue.
  const auto mix = [&](double a, double b, double c) {
    const double v = fraction < 0.5 ? a + 2.0 * fraction * (b - a) : b + (2.0 * fraction - 1.0) * (c - b);
    return static_cast<int>(std::lround(v));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", mix(255, 65, 8), mix(255, 182, 29), mix(204, 196, 88));
}

namespace {

/// "#rrggbb"; white for none.
std::array<std::uint8_t, 3> ReadColor(const std::string& color) {
  if (color.empty()) return {255, 255, 255};
  const auto part = [&](size_t at) {
    return static_cast<std::uint8_t>(std::stoi(color.substr(at, 2), nullptr, 16));
  };
  return {part(1), part(3), part(5)};
}

/// The cells as a picture that stands in the page, over the whole frame.
Html DrawCells(const HeatMap& map) {
  const auto columns = static_cast<int>(map.x.values.size());
  const auto rows = static_cast<int>(map.y.values.size());
  Image image(columns, rows);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const auto color =
          ReadColor(map.cells[static_cast<size_t>(j) * map.x.values.size() + static_cast<size_t>(i)].color);
      std::copy(color.begin(), color.end(), image.Pixel(i, rows - 1 - j));
    }
  }
  const TemporaryFolder folder;
  WritePicture(folder.path() / "map.png", image);
  return FormatHtml(
      "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" "
      "style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>\n",
      kLeft, kTop, kInnerWidth, kInnerHeight, Html::Raw(EncodeBase64(ReadBytes(folder.path() / "map.png"))));
}

}  // namespace

Html DrawHeatMap(const HeatMap& map) {
  const size_t columns = map.x.values.size();
  const size_t rows = map.y.values.size();
  const double w = kInnerWidth / static_cast<double>(columns);
  const double h = kInnerHeight / static_cast<double>(rows);
  const auto left = [&](double column) { return kLeft + w * column; };
  const auto top = [&](double row) { return kTop + kInnerHeight - h * (row + 1.0); };
  Html svg = Open(map.title, kWidth + (map.range ? kScaleRoom : 0.0), kHeight);
  Html edges;
  if (map.as_image) svg += DrawCells(map);
  for (size_t j = 0; j < rows && !map.as_image; ++j) {
    for (size_t i = 0; i < columns; ++i) {
      const HeatCell& cell = map.cells[j * columns + i];
      if (cell.color.empty()) continue;
      const double x = left(static_cast<double>(i));
      const double y = top(static_cast<double>(j));
      svg += Link(cell.link, cell.title, "rect",
                  FormatHtml("x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"{}\"", x, y,
                             w, h, cell.color));
      const auto differs = [&](size_t other) {
        return map.with_boundary && !map.cells[other].color.empty() && map.cells[other].held != cell.held;
      };
      if (i + 1 < columns && differs(j * columns + i + 1)) edges += DrawEdge(x + w, y, x + w, y + h);
      if (j + 1 < rows && differs((j + 1) * columns + i)) edges += DrawEdge(x, y, x + w, y);
    }
  }
  svg += edges;
  for (const Dots& dots : map.overlays) {
    for (const auto& [x, y] : dots.points) {
      svg += FormatHtml("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.2\" fill=\"{}\" class=\"dot\"/>\n",
                        left(FindPlace(map.x, x) + 0.5), top(FindPlace(map.y, y) - 0.5), dots.color);
    }
  }
  for (const double value : ListCellTicks(map.x)) {
    svg += DrawTick(true, left(FindPlace(map.x, value) + 0.5), LabelTick(map.x, value, 3),
                    map.x.labels.empty() ? kInnerWidth : w);
  }
  for (const double value : ListCellTicks(map.y))
    svg += DrawTick(false, top(FindPlace(map.y, value) - 0.5), LabelTick(map.y, value, 3));
  if (map.range) svg += DrawScale((*map.range)[0], (*map.range)[1]);
  svg += DrawLabels(map.x, map.y);
  svg += "</svg></figure>\n";
  return svg;
}

Html DrawChart(Chart chart) {
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
  // Texts have their place whether there are points above them or not.
  const std::vector<double> labelled = ListLabelled(chart.x);
  xs.insert(xs.end(), labelled.begin(), labelled.end());
  Fit(&chart.x, xs);
  Fit(&chart.y, ys);
  const auto place_x = [&](double x) { return kLeft + kInnerWidth * FindPlace(chart.x, x); };
  const auto place_y = [&](double y) { return kTop + kInnerHeight * (1.0 - FindPlace(chart.y, y)); };
  const auto named = static_cast<int>(std::count_if(
      chart.lines.begin(), chart.lines.end(), [](const ChartLine& line) { return !line.label.empty(); }));
  const int key_rows = (named + kKeyColumns - 1) / kKeyColumns;
  Html svg = Open(chart.title, kWidth, kHeight + kKeyRow * key_rows);
  svg += FormatHtml("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" class=\"frame\"/>\n", kLeft, kTop,
                    kInnerWidth, kInnerHeight);
  const auto list = [](const Axis& axis) {
    if (!axis.labels.empty()) return ListLabelled(axis);
    return ListRoundValues(axis.values[0], axis.values[1], axis.logarithmic);
  };
  const double room = chart.x.labels.size() < 2 ? kInnerWidth : place_x(1.0) - place_x(0.0);
  for (const double value : list(chart.x))
    svg += DrawTick(true, place_x(value), LabelTick(chart.x, value, kRoundDigits), room);
  for (const double value : list(chart.y))
    svg += DrawTick(false, place_y(value), LabelTick(chart.y, value, kRoundDigits));
  int key = 0;
  for (const ChartLine& line : chart.lines) {
    std::string points;
    for (const auto& [x, y] : line.points) {
      if (std::isfinite(y)) points += fmt::format("{:.1f},{:.1f} ", place_x(x), place_y(y));
    }
    svg += FormatHtml("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", points,
                      line.color);
    if (!line.label.empty()) svg += DrawKey(key++, line);
  }
  for (const ChartPoint& point : chart.points) {
    if (!std::isfinite(point.x) || !std::isfinite(point.y)) continue;
    svg += Link(point.link, point.title, "circle",
                FormatHtml("cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"", place_x(point.x),
                           place_y(point.y), point.color));
  }
  svg += DrawLabels(chart.x, chart.y);
  svg += "</svg></figure>\n";
  return svg;
}

}  // namespace dexcheck
