#include "renders/overlay.h"

#include <cairo-ft.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/files.h"

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
  const auto surface = ToSurface(Image(1, 1));
  const CairoPtr cairo = MakeCairo(surface.get());
  const bool has_width = MeasureWith(cairo, face_.get(), "x", 10.0) > 0.0;
  const cairo_status_t status = cairo_status(cairo.get());
  if (status == CAIRO_STATUS_SUCCESS && has_width) return;
  throw InputError(path.string() + ": cannot be used as a font" +
                   (has_width ? std::string(": ") + cairo_status_to_string(status) : ""));
}

double Font::Measure(const std::string& text, double size) const {
  static const auto surface = ToSurface(Image(1, 1));
  return MeasureWith(MakeCairo(surface.get()), face_.get(), MendUtf8(text), size);
}

Canvas::Canvas(Image* image)
    : image_(*image), surface_(ToSurface(*image)), cairo_(MakeCairo(surface_.get())) {}

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

namespace {

using Align = Canvas::Align;

const Color kText = MakeColor(0xf2f5f8);
const Color kFaint = MakeColor(0xa9b5c2);
const Color kMark = MakeColor(0xff9a3d);
const Color kPanel = MakeColor(0x0e141c, 0.72F);
const Color kRule = MakeColor(0xffffff, 0.14F);
const Color kGood = MakeColor(0x3ddc84);
const Color kBad = MakeColor(0xff5a52);
const Color kUnknown = MakeColor(0x6b7785);

// Sizes at 720 rows.
constexpr double kMargin = 20.0;
constexpr double kPadding = 16.0;
constexpr double kWidth = 316.0;
constexpr double kTitleSize = 19.0;
constexpr double kTextSize = 14.5;
constexpr double kSmallSize = 11.5;
constexpr double kLine = 23.0;
constexpr double kNarrow = 850.0;  // pictures narrower than this have a smaller panel
constexpr double kPlotHeight = 58.0;

/// The text, shortened with an ellipsis to fit.
std::string Fit(std::string text, double width, double size, const Font& font) {
  if (font.Measure(text, size) <= width) return text;
  while (!text.empty() && font.Measure(text + "\u2026", size) > width) {
    do {
      text.pop_back();
    } while (!text.empty() && (static_cast<unsigned char>(text.back()) & 0xc0U) == 0x80U);
  }
  return text + "\u2026";
}

double CalcScale(int width, int height) { return std::min(height / 720.0, width / kNarrow); }

}  // namespace

std::string FormatSi(double value, const std::string& unit) {
  if (!std::isfinite(value)) return "not finite";
  struct Prefix {
    double factor;
    const char* name;
  };
  static constexpr std::array<Prefix, 4> kPrefixes = {
      {{1.0, ""}, {1e-3, "m"}, {1e-6, "\u00b5"}, {1e-9, "n"}}};
  const double size = std::abs(value);
  if (size == 0.0) return "0 " + unit;
  // Compared with what rounds to 1.00 of the prefix.
  const auto* prefix =
      std::ranges::find_if(kPrefixes, [&](const Prefix& p) { return size >= 0.9995 * p.factor; });
  if (prefix == kPrefixes.end()) return "< 1 n" + unit;
  const double scaled = value / prefix->factor;
  const int decimals = std::abs(scaled) < 9.995 ? 2 : std::abs(scaled) < 99.95 ? 1 : 0;
  return fmt::format("{:.{}f} {}{}", scaled, decimals, prefix->name, unit);
}

Overlay::Overlay()
    : regular_(Font::SystemFolder() / "DejaVuSans.ttf"),
      bold_(Font::SystemFolder() / "DejaVuSans-Bold.ttf") {}

void Overlay::DrawPlot(const OverlayState& state, const Vector2d& corner, const Vector2d& size, double s,
                       Canvas* canvas) {
  const double low = std::log10(state.error_low);
  const double high = std::max(std::log10(state.error_high), low + 1.0);
  const double label_width = 52.0 * s;
  const double left = corner.x() + label_width;
  const double width = size.x() - label_width;
  const auto row = [&](double decade) {
    return corner.y() + size.y() * (high - std::clamp(decade, low, high)) / (high - low);
  };
  const int decades = static_cast<int>(std::floor(high) - std::ceil(low)) + 1;
  const int every = std::max(1, (decades + 2) / 3);
  for (int decade = static_cast<int>(std::ceil(low)); decade <= std::floor(high); decade += every) {
    canvas->StrokeLine({left, row(decade)}, {left + width, row(decade)}, 1.0 * s, kRule);
    std::string label = FormatSi(std::pow(10.0, decade), "m");
    label =
        fmt::format("{:.0f} {}", std::pow(10.0, ((decade % 3) + 3) % 3), label.substr(label.find(' ') + 1));
    canvas->DrawText(regular_, kSmallSize * s, {left - 7.0 * s, row(decade) + 4.0 * s}, label, kFaint,
                     Align::kRight);
  }
  std::vector<Vector2d> path;
  for (const Vector2d& sample : state.history) {
    const double x = left + width * (1.0 + (sample.x() - state.time) / state.history_span);
    const double error = std::isfinite(sample.y()) ? std::max(sample.y(), state.error_low) : state.error_high;
    if (x >= left - 1e-9) path.emplace_back(x, row(std::log10(error)));
  }
  canvas->StrokePath(path, 1.8 * s, kMark);
  if (!path.empty()) canvas->FillCircle(path.back(), 3.2 * s, kMark);
}

double Overlay::CalcCoveredWidth(int width, int height) {
  return (kMargin + kWidth) * CalcScale(width, height);
}

OverlayState MakeOverlayState(const RunFrames& run, long row, const std::vector<CategoryStatus>& categories) {
  const auto at = static_cast<size_t>(row);
  OverlayState state;
  state.title = run.title;
  if (!run.phases.empty()) state.title += ": " + run.phases[at];
  state.time = run.times[at];
  const auto add = [&](const char* name, const std::vector<double>& series, const char* unit) {
    if (!series.empty()) state.rows.push_back({name, FormatSi(series[at], unit)});
  };
  add("position error", run.position_errors, "m");
  add("orientation error", run.orientation_errors, "rad");
  add("joint error", run.joint_errors, "rad");
  state.categories = categories;
  return state;
}

void Overlay::Draw(const OverlayState& state, Image* image) {
  const double s = CalcScale(image->width, image->height);
  const auto rows = static_cast<double>(state.rows.size());
  const auto categories = static_cast<double>(state.categories.size());
  const auto keys = static_cast<double>(state.legend.size());
  double height = 2.0 * kPadding + kLine;
  if (rows > 0) height += 10.0 + rows * kLine;
  if (!state.history.empty()) height += kPlotHeight + 22.0;
  if (categories > 0) height += 14.0 + (categories + 0.8) * kLine;
  if (keys > 0) height += 12.0 + keys * kLine;

  Canvas canvas(image);
  const Vector2d corner = s * Vector2d(kMargin, kMargin);
  canvas.FillRoundedRectangle(corner, s * Vector2d(kWidth, height), 12.0 * s, kPanel);
  const double left = corner.x() + kPadding * s;
  const double right = corner.x() + (kWidth - kPadding) * s;
  double y = corner.y() + (kPadding + 15.0) * s;
  const auto draw_rule = [&] { canvas.StrokeLine({left, y}, {right, y}, s, kRule); };
  const auto draw_row = [&](double x, const OverlayRow& row) {
    canvas.DrawText(regular_, kTextSize * s, {x, y}, row.name, kFaint);
    canvas.DrawText(regular_, kTextSize * s, {right, y}, row.value, kText, Align::kRight);
  };

  const std::string time = fmt::format("{:.2f} s", state.time);
  const double title_width = right - left - bold_.Measure(time, kTitleSize * s) - 12.0 * s;
  canvas.DrawText(bold_, kTitleSize * s, {left, y}, Fit(state.title, title_width, kTitleSize * s, bold_),
                  kText);
  canvas.DrawText(bold_, kTitleSize * s, {right, y}, time, kText, Align::kRight);
  y += 10.0 * s;
  for (const OverlayRow& row : state.rows) {
    y += kLine * s;
    draw_row(left, row);
  }
  if (!state.history.empty()) {
    y += 18.0 * s;
    DrawPlot(state, {left, y}, {right - left, kPlotHeight * s}, s, &canvas);
    y += (kPlotHeight + 4.0) * s;
  }
  if (categories > 0) {
    y += 12.0 * s;
    draw_rule();
    y += 0.8 * kLine * s;
    canvas.DrawText(regular_, kSmallSize * s, {left, y}, "cross-check", kFaint);
    canvas.DrawText(regular_, kSmallSize * s, {right, y}, "worst so far / bound", kFaint, Align::kRight);
    for (const CategoryStatus& status : state.categories) {
      y += kLine * s;
      const Color& dot = !status.is_asked() ? kUnknown : status.failed == 0 ? kGood : kBad;
      canvas.FillCircle({left + 5.0 * s, y - 5.0 * s}, 5.0 * s, dot);
      draw_row(left + 19.0 * s,
               {TitleOf(status.category),
                status.is_asked() ? fmt::format("{:.1e} / {:.0e}", status.nearest.worst, status.nearest.bound)
                                  : "not checked"});
    }
  }
  if (keys > 0) {
    y += 12.0 * s;
    draw_rule();
    for (const LegendEntry& entry : state.legend) {
      y += kLine * s;
      canvas.StrokeLine({left, y - 5.0 * s}, {left + 14.0 * s, y - 5.0 * s}, 4.0 * s, entry.color);
      canvas.DrawText(regular_, kTextSize * s, {left + 24.0 * s, y}, entry.text, kFaint);
    }
  }
}

}  // namespace dexcheck
