#pragma once

// Line plots over the time of a run.

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// One line of a figure.
struct Curve {
  std::string label;
  VectorXd values;          ///< One for each row of the run; what is not finite is a gap.
  int color = 0;            ///< Number in the palette; kGrey for what stays in the background.
  int dash = 0;             ///< 0 solid; 1, 2, 3 dashes of their own.
  bool right_axis = false;  ///< Belongs to the axis on the right.
  bool in_key = true;       ///< Named in the picture's key.
  bool wide = false;        ///< A pale band, for what should be: a line that lies on it is still seen.
};

inline constexpr int kGrey = -1;

/// "#rrggbb" of a palette's color; numbers beyond its end begin anew.
std::string FindColor(int color);

/// Lengths of strokes and gaps in pixels; none for a solid line.
std::vector<int> FindDashes(int dash);

/// A plot of curves over time.
struct Figure {
  std::string name;        ///< Of its files: "fig12a".
  std::string panel = {};  ///< Number in the paper, "12 (a)"; empty for figures that it lacks.
  std::string title;
  std::string label = {};        ///< Of the axis: "position (m)".
  std::string right_label = {};  ///< Empty when no curve uses the right axis.
  bool log = false;              ///< Values up to 0 are gaps.
  double least_span = 0.0;       ///< Axes show at least this much, so that rounding errors don't fill them.
  std::optional<double> bound = {};  ///< A dashed line at this value.
  std::optional<double> band = {};   ///< What lies this far from 0 is shaded; on pages only.
  bool below = false;                ///< Stands below the figure before it, of the same thing; on pages only.
  bool answers = false;              ///< Stands first, and the figures that do not are folded; on pages only.
  std::vector<Curve> curves = {};
  std::string note = {};  ///< What the reader has to know; may be empty.
  bool printed = false;   ///< Drawn as a picture for print, too.
};

/// Range of an axis, from below to above. With two axes the curves of the left one are in the upper half
/// and those of the right one in the lower half, so that none hides another by chance.
std::array<double, 2> CalcAxisRange(const Figure& figure, bool right_axis);

/// Extensions of the files of a printed figure.
inline constexpr std::array<const char*, 3> kFigureFiles = {".pdf", ".png", ".csv"};

/// Draws figures as FOLDER/NAME.pdf, with its fonts in it, and FOLDER/NAME.png, with gnuplot, from what it
/// writes as FOLDER/NAME.csv.
/// @param time of the curves' values, s.
/// @throws InputError when gnuplot cannot be run, or a file cannot be written.
void DrawFigures(const std::vector<Figure>& figures, const VectorXd& time,
                 const std::filesystem::path& folder);

// Fewer points of a long series, with its extremes kept.

/// Divides the rows of a run into intervals of nearly equal length and keeps of each series, in each
/// interval, the least and the largest value, in the order in which they occur. A line through what is kept
/// covers what the whole series would. When all rows fit, all are kept.
class Thinning {
 public:
  /// @param most points to keep of each series, at least 2.
  Thinning(const VectorXd& time, long most);

  /// First and last time of each interval, s.
  [[nodiscard]] const std::vector<double>& times() const { return times_; }
  /// Values of a series, as many as times(). Where an interval has finite values, others are left out.
  /// @param values one for each row of the run.
  [[nodiscard]] std::vector<double> Apply(const VectorXd& values) const;
  [[nodiscard]] bool keeps_all() const { return starts_.empty(); }

 private:
  std::vector<long> starts_;  // of the intervals, and the end of the last; empty when all rows are kept
  std::vector<double> times_;
};

}  // namespace dexcheck
