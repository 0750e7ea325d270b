#pragma once

// Smooth shapes and text on a picture, by Cairo. Positions in pixels, y downwards; a pixel's centre is at
// half a pixel.

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "controller/common/types.h"
#include "renders/image.h"

// Cairo chose these names.
// NOLINTBEGIN(bugprone-reserved-identifier)
struct _cairo;
struct _cairo_font_face;
struct _cairo_surface;
// NOLINTEND(bugprone-reserved-identifier)

namespace dexcheck {

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

}  // namespace dexcheck
