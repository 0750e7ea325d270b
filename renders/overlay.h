#pragma once

// The panel that shows on each frame how the run stands: scenario, time, tracking error, and the five
// categories of the cross-check.

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "renders/image.h"
#include "renders/viewpoint.h"

// Cairo chose these names.
// NOLINTBEGIN(bugprone-reserved-identifier)
struct _cairo;
struct _cairo_font_face;
// NOLINTEND(bugprone-reserved-identifier)

namespace dexcheck {

// Smooth shapes and text on a picture, by Cairo. Positions in pixels, y downwards; a pixel's centre is at
// half a pixel.

/// Opaque or translucent colour from "rrggbb".
Color MakeColor(unsigned rrggbb, float opacity = 1.0F);

/// An outline font, drawn smoothly at any size. For one thread.
class Font {
 public:
  /// Folder of the DejaVu fonts, those that are installed with the program or the system's: "DejaVuSans.ttf",
  /// "DejaVuSans-Bold.ttf".
  static std::filesystem::path SystemFolder();

  /// @throws InputError "PATH: cannot be used as a font: reason".
  explicit Font(const std::filesystem::path& path);

  /// Width of a text in pixels. @param text UTF-8; @param size of the font in pixels.
  [[nodiscard]] double Measure(const std::string& text, double size) const;

 private:
  friend class Canvas;
  std::shared_ptr<_cairo_font_face> face_;
};

/// Draws on one picture, which has what was drawn when the canvas is destroyed; what lies outside of it is
/// cut off.
class Canvas {
 public:
  explicit Canvas(Image* image);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  void FillRoundedRectangle(const Vector2d& corner, const Vector2d& size, double radius, const Color& color);
  void FillCircle(const Vector2d& center, double radius, const Color& color);
  void StrokePath(std::span<const Vector2d> points, double width, const Color& color);
  void StrokeLine(const Vector2d& from, const Vector2d& to, double width, const Color& color);

  enum class Align { kLeft, kCenter, kRight };
  /// @param baseline where the text's line stands, at its left end, centre, or right end.
  void DrawText(const Font& font, double size, const Vector2d& baseline, const std::string& text,
                const Color& color, Align align = Align::kLeft);

 private:
  Image& image_;
  std::shared_ptr<_cairo_surface> surface_;
  std::shared_ptr<_cairo> cairo_;
};

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

/// A length, angle or other number with a prefix that keeps one to three digits before the point: "12.4 nm";
/// "< 1 nm" below that.
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
