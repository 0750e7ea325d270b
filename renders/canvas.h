#pragma once

// Smooth shapes and text on a picture. Positions in pixels, y downwards; a pixel's centre is at half a pixel.

#include <span>
#include <string>
#include <utility>

#include "controller/common/types.h"
#include "renders/decoration.h"
#include "renders/font.h"
#include "renders/image.h"

namespace dexcheck {

/// Opaque or translucent colour from "rrggbb".
Color MakeColor(unsigned rrggbb, float opacity = 1.0F);

/// Draws on one picture; what lies outside of it is cut off.
class Canvas {
 public:
  explicit Canvas(Image* image) : image_(*image) {}

  void FillRoundedRectangle(const Vector2d& corner, const Vector2d& size, double radius, const Color& color);
  void FillCircle(const Vector2d& center, double radius, const Color& color);
  void StrokePath(std::span<const Vector2d> points, double width, const Color& color);
  void StrokeLine(const Vector2d& from, const Vector2d& to, double width, const Color& color);

  enum class Align { kLeft, kCenter, kRight };
  /// @param baseline where the text's line stands, at its left end, centre, or right end.
  void DrawText(Font& font, double size, const Vector2d& baseline, const std::string& text,
                const Color& color, Align align = Align::kLeft);

 private:
  void Blend(int x, int y, const Color& color, double coverage);
  /// The pixels between two corners, within the picture.
  struct Range {
    int x_begin, x_end, y_begin, y_end;
  };
  [[nodiscard]] Range Clip(const Vector2d& low, const Vector2d& high) const;

  Image& image_;
};

}  // namespace dexcheck
