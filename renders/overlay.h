#pragma once

// The panel that shows on each frame how the run stands: scenario, time, tracking error, and the five
// categories of the cross-check.

#include <string>
#include <vector>

#include "controller/common/types.h"
#include "renders/canvas.h"
#include "renders/image.h"
#include "renders/run_frames.h"

namespace dexcheck {

/// A line of the key to what is drawn in the scene.
struct LegendEntry {
  std::string text;
  Color color;
};

/// A line of the panel with a name at its left and a value at its right.
struct OverlayRow {
  std::string name;
  std::string value;
};

struct OverlayState {
  std::string title;
  double time = 0.0;             ///< s.
  std::vector<OverlayRow> rows;  ///< Tracking errors.
  /// (time in s, position error in m) of the span that the plot shows, oldest first.
  std::vector<Vector2d> history;
  double history_span = 3.0;  ///< s; the plot ends now and began so long ago.
  double error_low = 1e-9;    ///< m; range of the plot.
  double error_high = 1e-3;   ///< m.
  std::vector<CategoryStatus> categories;
  std::vector<LegendEntry> legend;
};

/// Title, time and errors of one row of a run, and where its checks stand then.
OverlayState MakeOverlayState(const RunFrames& run, long row, const std::vector<CategoryStatus>& categories);

/// A length, angle or other number with a prefix that keeps one to three digits before the point: "12.4 nm".
std::string FormatSi(double value, const std::string& unit);

class Overlay {
 public:
  /// Loads the fonts. @throws InputError when they are not installed.
  Overlay();

  /// How much of a picture of this size the panel may cover from the left, in pixels.
  static double CalcCoveredWidth(int width, int height);

  /// Draws the panel into the upper left corner, as large as the picture's size allows.
  void Draw(const OverlayState& state, Image* image);

 private:
  void DrawPlot(const OverlayState& state, const Vector2d& corner, const Vector2d& size, double scale,
                Canvas* canvas);

  Font regular_;
  Font bold_;
};

}  // namespace dexcheck
