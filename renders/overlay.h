#pragma once

// The panel that tells on each frame how the run stands: scenario, time, tracking error, and the five
// questions of the cross-check.

#include <optional>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "renders/canvas.h"
#include "renders/category_status.h"
#include "renders/font.h"
#include "renders/image.h"

namespace dexcheck {

/// A line of the key to what is drawn in the scene.
struct LegendEntry {
  std::string text;
  Color color;
};

struct OverlayState {
  std::string title;
  double time = 0.0;                        ///< s.
  std::optional<double> position_error;     ///< m.
  std::optional<double> orientation_error;  ///< rad.
  std::optional<double> joint_error;        ///< Of the joint that is farthest off, rad.
  std::optional<double> apart;              ///< How far the objects of two runs are from each other, m.
  /// (time in s, position error in m) of the span that the plot shows, oldest first.
  std::vector<Vector2d> history;
  double history_span = 3.0;  ///< s; the plot ends now and began so long ago.
  double error_low = 1e-9;    ///< m; range of the plot.
  double error_high = 1e-3;   ///< m.
  std::vector<CategoryStatus> questions;
  std::vector<LegendEntry> legend;
};

/// A length, angle or other number with a prefix that keeps one to three digits before the point: "12.4 nm".
std::string FormatSi(double value, const std::string& unit);

class Overlay {
 public:
  /// Loads the fonts. @throws InputError when they are not installed.
  Overlay();

  /// How much of a picture of this size the panel may cover from the left, in pixels.
  static double CalcCoveredWidth(int width, int height);

  /// Draws the panel into the upper left corner, as large as the picture's size asks for.
  void Draw(const OverlayState& state, Image* image);

 private:
  void DrawPlot(const OverlayState& state, const Vector2d& corner, const Vector2d& size, double scale,
                Canvas* canvas);

  Font regular_;
  Font bold_;
};

}  // namespace dexcheck
