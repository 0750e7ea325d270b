#pragma once

// Charts of studies as inline SVG.

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "harness/report/html.h"

namespace dexcheck {

struct Axis {
  std::string label;
  std::vector<double> values;  ///< Ascending; the cells' of a heat map, else the ends.
  bool logarithmic = false;
  std::vector<std::string> labels = {};  ///< Of the values 0, 1, ..; empty for numbers.
};

struct HeatCell {
  std::string color;  ///< Empty for no cell.
  std::string title;  ///< Shown when pointed at.
  std::string link;
  bool held = true;  ///< Between held and other cells runs the measured boundary.
};

/// Dots in data coordinates.
struct Dots {
  std::string color;
  std::vector<std::pair<double, double>> points;
};

struct HeatMap {
  std::string title;
  Axis x, y;
  std::vector<HeatCell> cells;  ///< Row by row of y, from the least.
  bool with_boundary = false;
  std::optional<std::array<double, 2>> range;  ///< Of the values that colours stand for; none for no scale.
  std::vector<Dots> overlays;
  bool as_image = false;  ///< A picture with a pixel for each cell, without titles and links.
};
Html DrawHeatMap(const HeatMap& map);

struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
  std::string color;
  std::string title;
  std::string link;
};

struct ChartLine {
  std::string label;
  std::string color;
  std::vector<std::pair<double, double>> points;
};

struct Chart {
  std::string title;
  Axis x, y;  ///< Ends of the axes are taken from points and lines.
  std::vector<ChartPoint> points;
  std::vector<ChartLine> lines;
};
Html DrawChart(Chart chart);

/// Colour of a value between the least and the most, by its logarithm where the range spans decades.
std::string ColorOf(double value, double least, double most);

}  // namespace dexcheck
