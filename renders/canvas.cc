#include "renders/canvas.h"

#include <cairo-ft.h>

#include <array>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/files.h"
#include "renders/cairo_surface.h"

namespace dexcheck {
namespace {

using CairoPtr = std::shared_ptr<cairo_t>;

/// Text as it is drawn: hinted a little, as the desktop does.
CairoPtr MakeCairo(cairo_surface_t* surface) {
  CairoPtr cairo(cairo_create(surface), cairo_destroy);
  cairo_font_options_t* const options = cairo_font_options_create();
  cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_SLIGHT);
  cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(cairo.get(), options);
  cairo_font_options_destroy(options);
  cairo_set_line_cap(cairo.get(), CAIRO_LINE_CAP_ROUND);
  cairo_set_line_join(cairo.get(), CAIRO_LINE_JOIN_ROUND);
  return cairo;
}

void SetColor(const CairoPtr& cairo, const Color& color) {
  cairo_set_source_rgba(cairo.get(), static_cast<double>(color[0]), static_cast<double>(color[1]),
                        static_cast<double>(color[2]), static_cast<double>(color[3]));
}

double MeasureWith(const CairoPtr& cairo, cairo_font_face_t* face, const std::string& text, double size) {
  cairo_set_font_face(cairo.get(), face);
  cairo_set_font_size(cairo.get(), size);
  cairo_text_extents_t extents;
  cairo_text_extents(cairo.get(), text.c_str(), &extents);
  return extents.x_advance;
}

}  // namespace

Color MakeColor(unsigned rrggbb, float opacity) {
  const auto channel = [&](unsigned shift) { return static_cast<float>(rrggbb >> shift & 0xffU) / 255.0F; };
  return {channel(16), channel(8), channel(0), opacity};
}

std::filesystem::path Font::SystemFolder() {
  std::filesystem::path installed = FindInstalled("share/dexcheck/fonts");
  std::error_code error;
  return std::filesystem::exists(installed, error) ? installed : DEXCHECK_FONT_FOLDER;
}

Font::Font(const std::filesystem::path& path) {
  const std::unique_ptr<FcPattern, decltype(&FcPatternDestroy)> pattern(
      FcPatternBuild(nullptr, FC_FILE, FcTypeString, path.c_str(), nullptr), FcPatternDestroy);
  face_.reset(cairo_ft_font_face_create_for_pattern(pattern.get()), cairo_font_face_destroy);
  const SurfacePtr surface = ToSurface(Image(1, 1));
  const CairoPtr cairo = MakeCairo(surface.get());
  const bool has_width = MeasureWith(cairo, face_.get(), "x", 10.0) > 0.0;
  const cairo_status_t status = cairo_status(cairo.get());
  if (status == CAIRO_STATUS_SUCCESS && has_width) return;
  throw InputError(path.string() + ": cannot be used as a font" +
                   (has_width ? std::string(": ") + cairo_status_to_string(status) : ""));
}

double Font::Measure(const std::string& text, double size) const {
  static const SurfacePtr surface = ToSurface(Image(1, 1));
  return MeasureWith(MakeCairo(surface.get()), face_.get(), MendUtf8(text), size);
}

Canvas::Canvas(Image* image)
    : image_(*image),
      surface_(ToSurface(*image).release(), cairo_surface_destroy),
      cairo_(MakeCairo(surface_.get())) {}

Canvas::~Canvas() { CopySurface(surface_.get(), &image_); }

void Canvas::FillRoundedRectangle(const Vector2d& corner, const Vector2d& size, double radius,
                                  const Color& color) {
  cairo_new_path(cairo_.get());
  const Vector2d inner = size - Vector2d::Constant(2.0 * radius);
  const Vector2d first = corner + Vector2d::Constant(radius);
  for (int k = 0; k < 4; ++k) {  // from the upper left corner clockwise
    const double x = first.x() + (k == 1 || k == 2 ? inner.x() : 0.0);
    const double y = first.y() + (k >= 2 ? inner.y() : 0.0);
    cairo_arc(cairo_.get(), x, y, radius, kPi * (1.0 + 0.5 * k), kPi * (1.5 + 0.5 * k));
  }
  SetColor(cairo_, color);
  cairo_fill(cairo_.get());
}

void Canvas::FillCircle(const Vector2d& center, double radius, const Color& color) {
  const Vector2d half = Vector2d::Constant(radius);
  FillRoundedRectangle(center - half, 2.0 * half, radius, color);
}

void Canvas::StrokePath(std::span<const Vector2d> points, double width, const Color& color) {
  if (points.size() < 2) return;
  cairo_new_path(cairo_.get());
  for (const Vector2d& point : points) cairo_line_to(cairo_.get(), point.x(), point.y());
  SetColor(cairo_, color);
  cairo_set_line_width(cairo_.get(), width);
  cairo_stroke(cairo_.get());
}

void Canvas::StrokeLine(const Vector2d& from, const Vector2d& to, double width, const Color& color) {
  const std::array<Vector2d, 2> ends = {from, to};
  StrokePath(ends, width, color);
}

void Canvas::DrawText(const Font& font, double size, const Vector2d& baseline, const std::string& text,
                      const Color& color, Align align) {
  const std::string mended = MendUtf8(text);
  const double width = MeasureWith(cairo_, font.face_.get(), mended, size);
  const double before = align == Align::kCenter ? 0.5 * width : align == Align::kRight ? width : 0.0;
  SetColor(cairo_, color);
  // On whole pixels the letters of a line are drawn the same way in all frames.
  cairo_move_to(cairo_.get(), std::round(baseline.x() - before), std::round(baseline.y()));
  cairo_show_text(cairo_.get(), mended.c_str());
}

}  // namespace dexcheck
