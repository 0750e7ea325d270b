#include "renders/canvas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace dexcheck {
namespace {

/// Fraction of a pixel inside an edge at this signed distance (inside negative) from its centre.
double Coverage(double distance) { return std::clamp(0.5 - distance, 0.0, 1.0); }

double DistanceToSegment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d ab = b - a;
  const double length_squared = ab.squaredNorm();
  const double t = length_squared > 0.0 ? std::clamp((p - a).dot(ab) / length_squared, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

}  // namespace

Color MakeColor(unsigned rrggbb, float opacity) {
  const auto channel = [&](unsigned shift) { return static_cast<float>(rrggbb >> shift & 0xffU) / 255.0F; };
  return {channel(16), channel(8), channel(0), opacity};
}

void Canvas::Blend(int x, int y, const Color& color, double coverage) {
  const float opacity = color[3] * static_cast<float>(coverage);
  if (opacity <= 0.0F) return;
  std::uint8_t* pixel = image_.Pixel(x, y);
  for (int k = 0; k < 3; ++k) {
    const auto old = static_cast<float>(pixel[k]);
    const float mixed = old + opacity * (255.0F * color[static_cast<size_t>(k)] - old);
    pixel[k] = static_cast<std::uint8_t>(std::clamp(mixed + 0.5F, 0.0F, 255.0F));
  }
}

Canvas::Range Canvas::Clip(const Vector2d& low, const Vector2d& high) const {
  const auto bound = [](double value, int most) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(most)));
  };
  return {bound(std::floor(low.x()), image_.width), bound(std::ceil(high.x()), image_.width),
          bound(std::floor(low.y()), image_.height), bound(std::ceil(high.y()), image_.height)};
}

void Canvas::FillRoundedRectangle(const Vector2d& corner, const Vector2d& size, double radius,
                                  const Color& color) {
  const Vector2d center = corner + 0.5 * size;
  const Vector2d inner = 0.5 * size - Vector2d::Constant(radius);
  const Range range = Clip(corner - Vector2d::Ones(), corner + size + Vector2d::Ones());
  for (int y = range.y_begin; y < range.y_end; ++y) {
    for (int x = range.x_begin; x < range.x_end; ++x) {
      const Vector2d beyond = (Vector2d(x + 0.5, y + 0.5) - center).cwiseAbs() - inner;
      const double distance = beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0) - radius;
      Blend(x, y, color, Coverage(distance));
    }
  }
}

void Canvas::FillCircle(const Vector2d& center, double radius, const Color& color) {
  const Vector2d half = Vector2d::Constant(radius);
  FillRoundedRectangle(center - half, 2.0 * half, radius, color);
}

void Canvas::StrokePath(std::span<const Vector2d> points, double width, const Color& color) {
  if (points.size() < 2) return;
  Vector2d low = points.front();
  Vector2d high = low;
  for (const Vector2d& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Vector2d margin = Vector2d::Constant(0.5 * width + 1.0);
  const Range box = Clip(low - margin, high + margin);
  const int box_width = box.x_end - box.x_begin;
  if (box_width <= 0 || box.y_end <= box.y_begin) return;
  // Joints are covered twice but must be blended once.
  std::vector<float> coverage(static_cast<size_t>(box_width) * static_cast<size_t>(box.y_end - box.y_begin));
  const auto at = [&](int x, int y) -> float& {
    return coverage[static_cast<size_t>(y - box.y_begin) * static_cast<size_t>(box_width) +
                    static_cast<size_t>(x - box.x_begin)];
  };
  for (size_t i = 1; i < points.size(); ++i) {
    const Vector2d& a = points[i - 1];
    const Vector2d& b = points[i];
    const Range range = Clip(a.cwiseMin(b) - margin, a.cwiseMax(b) + margin);
    for (int y = range.y_begin; y < range.y_end; ++y) {
      for (int x = range.x_begin; x < range.x_end; ++x) {
        const double distance = DistanceToSegment({x + 0.5, y + 0.5}, a, b) - 0.5 * width;
        at(x, y) = std::max(at(x, y), static_cast<float>(Coverage(distance)));
      }
    }
  }
  for (int y = box.y_begin; y < box.y_end; ++y) {
    for (int x = box.x_begin; x < box.x_end; ++x) Blend(x, y, color, static_cast<double>(at(x, y)));
  }
}

void Canvas::StrokeLine(const Vector2d& from, const Vector2d& to, double width, const Color& color) {
  const std::array<Vector2d, 2> ends = {from, to};
  StrokePath(ends, width, color);
}

void Canvas::DrawText(Font& font, double size, const Vector2d& baseline, const std::string& text,
                      const Color& color, Align align) {
  double pen = baseline.x();
  if (align == Align::kCenter) pen -= 0.5 * font.Measure(text, size);
  if (align == Align::kRight) pen -= font.Measure(text, size);
  const int line = static_cast<int>(std::lround(baseline.y()));
  font.Visit(text, size, [&](const Font::Glyph& glyph) {
    const int left = static_cast<int>(std::lround(pen)) + glyph.left;
    const int top = line - glyph.top;
    for (int y = std::max(0, -top); y < glyph.height && top + y < image_.height; ++y) {
      for (int x = std::max(0, -left); x < glyph.width && left + x < image_.width; ++x) {
        const std::uint8_t value = glyph.coverage[static_cast<size_t>(y * glyph.width + x)];
        Blend(left + x, top + y, color, value / 255.0);
      }
    }
    pen += glyph.advance;
  });
}

}  // namespace dexcheck
