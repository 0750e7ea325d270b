#include "harness/report/figure.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/child_process.h"
#include "harness/base/files.h"

namespace dexcheck {

namespace {

constexpr long kPointsPerCurve = 1200;  // two to a pixel
constexpr int kWidth = 640;
constexpr int kHeight = 330;
constexpr int kKeyRowHeight = 19;
constexpr int kKeyEntriesPerRow = 4;
constexpr const char* kGreyColor = "#9aa3ad";

/// A gnuplot string: single quotes, in which only the quote itself is special, and for its markup the
/// escapes.
std::string QuoteText(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (std::strchr("_^{}@&~\\", c) != nullptr && c != '\0') quoted += '\\';
    if (c == '\'') quoted += '\'';
    quoted += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  return quoted + "'";
}

/// gnuplot's axes end long before the range of a double, which a run that explodes may use up.
bool CanBeDrawn(const Figure& figure, double value) {
  constexpr double kLargest = 1e100;
  return figure.log ? value >= 1.0 / kLargest && value <= kLargest : std::abs(value) <= kLargest;
}

/// Least and largest value that can be drawn; least above largest when none.
std::array<double, 2> FindRange(const Figure& figure, bool right_axis) {
  std::array<double, 2> range = {std::numeric_limits<double>::infinity(),
                                 -std::numeric_limits<double>::infinity()};
  const auto include = [&](double value) {
    if (!CanBeDrawn(figure, value)) return;
    range = {std::min(range[0], value), std::max(range[1], value)};
  };
  for (const Curve& curve : figure.curves) {
    if (curve.right_axis == right_axis) std::for_each(curve.values.begin(), curve.values.end(), include);
  }
  if (figure.bound && !right_axis) include(*figure.bound);
  if (figure.band && !right_axis) include(*figure.band), include(-*figure.band);
  return range;
}

std::string SetRange(const Figure& figure, bool right_axis) {
  const std::array<double, 2> range = CalcAxisRange(figure, right_axis);
  return fmt::format("set {}range [{:.9g}:{:.9g}]\n", right_axis ? "y2" : "y", range[0], range[1]);
}

/// FOLDER/NAME.csv: time, then each curve, "LABEL, AXIS"; NaN where it has a gap.
void WriteData(const Figure& figure, const Thinning& thinning, const std::filesystem::path& folder) {
  std::vector<std::vector<double>> columns = {thinning.times()};
  std::string text = "t (s)";
  for (const Curve& curve : figure.curves) {
    columns.push_back(thinning.Apply(curve.values));
    text += "," + QuoteField(curve.label + ", " + (curve.right_axis ? figure.right_label : figure.label));
  }
  for (size_t row = 0; row < columns.front().size(); ++row) {
    text += fmt::format("\n{:.7g}", columns[0][row]);
    for (size_t i = 1; i < columns.size(); ++i) {
      const double value = columns[i][row];
      text += CanBeDrawn(figure, value) ? fmt::format(",{:.7g}", value) : ",NaN";
    }
  }
  WriteFile(folder / (figure.name + ".csv"), text + "\n");
}

std::string PlotCurves(const Figure& figure) {
  std::string plot = "plot ";
  for (size_t i = 0; i < figure.curves.size(); ++i) {
    const Curve& curve = figure.curves[i];
    std::string color = FindColor(curve.color);
    if (curve.wide) color.insert(1, "a0");  // gnuplot's transparency stands first
    plot += fmt::format("{}'{}.csv' skip 1 using 1:{} axes x1{} with lines lc rgb '{}' lw {} dt ",
                        i > 0 ? ", " : "", figure.name, i + 2, curve.right_axis ? "y2" : "y1", color,
                        curve.wide             ? "6"
                        : curve.color == kGrey ? "0.8"
                                               : "1.5");
    const std::vector<int> dashes = FindDashes(curve.dash);
    plot += dashes.empty() ? "1" : fmt::format("({})", fmt::join(dashes, ","));
    plot += !curve.in_key ? " notitle" : " title " + QuoteText(curve.label);
  }
  if (figure.bound) {
    plot += fmt::format(", {:.9g} with lines lc rgb '#c02020' lw 1.2 dt (8,5) title 'bound'", *figure.bound);
  }
  return plot + "\n";
}

void WriteScript(const Figure& figure, const VectorXd& time, std::ostream* script) {
  const auto named = std::ranges::count_if(figure.curves, [](const Curve& curve) { return curve.in_key; });
  const int key_rows = static_cast<int>(named + kKeyEntriesPerRow) / kKeyEntriesPerRow;
  const int height = kHeight + kKeyRowHeight * key_rows;
  const double end = std::max(time[time.size() - 1], time[0] + 1e-6);
  *script << fmt::format("set xrange [{:.9g}:{:.9g}]\n", time[0], end) << SetRange(figure, false)
          << "set ylabel " << QuoteText(figure.label) << "\n";
  if (figure.log) *script << "set logscale y\nset format y '10^{%T}'\n";
  if (!figure.right_label.empty()) {
    *script << SetRange(figure, true) << "set ytics nomirror\nset y2tics\nset y2label "
            << QuoteText(figure.right_label) << "\n";
  }
  const std::string plot = PlotCurves(figure);
  *script << fmt::format(
                 "set terminal pdfcairo size {:.2f}in,{:.2f}in font 'DejaVu Sans,9' enhanced\nset output "
                 "'{}.pdf'\n",
                 kWidth / 100.0, height / 100.0, figure.name)
          << plot
          << fmt::format(
                 "set terminal pngcairo size {},{} fontscale 2 linewidth 2 dashlength 2 font "
                 "'DejaVu Sans,11' enhanced\nset output '{}.png'\n",
                 2 * kWidth, 2 * height, figure.name)
          << plot << "unset output\nunset logscale\nset format y '% h'\nunset y2tics\nunset y2label\n";
}

/// Runs gnuplot on FOLDER/figures.gnuplot, in the folder.
void RunGnuplot(const std::filesystem::path& folder) {
  const FileDescriptor nothing(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  const MessageFile messages;
  ChildProcess gnuplot("gnuplot", Program{{FindProgram("gnuplot"), "--default-settings", "figures.gnuplot"},
                                          nothing.get(),
                                          messages.descriptor(),
                                          messages.descriptor(),
                                          folder});
  const TemporaryChild child(gnuplot.pid());
  const ProcessEnd end = gnuplot.Wait();
  if (end.has_succeeded()) return;
  if (end.exit_code == kNotFoundExitCode)
    throw InputError("gnuplot: cannot be run (Debian's package gnuplot-nox has it)");
  throw InputError("gnuplot: could not draw the figures: " + Abbreviate(messages.ReadLastLine()));
}

}  // namespace

std::string FindColor(int color) {
  static constexpr std::array<const char*, 8> kPalette = {"#1f6fc4", "#d9531e", "#0e8f6b", "#a341b0",
                                                          "#d09a00", "#2fa7d8", "#7a5c3e", "#d6407f"};
  return color == kGrey ? kGreyColor : kPalette[static_cast<size_t>(color) % kPalette.size()];
}

std::vector<int> FindDashes(int dash) {
  static const std::array<std::vector<int>, 4> kDashes = {{{}, {7, 4}, {2, 3}, {9, 3, 2, 3}}};
  return kDashes[static_cast<size_t>(dash) % kDashes.size()];
}

std::array<double, 2> CalcAxisRange(const Figure& figure, bool right_axis) {
  std::array<double, 2> range = FindRange(figure, right_axis);
  if (range[0] > range[1]) range = {1.0, 1.0};
  if (figure.log) {
    return {std::pow(10.0, std::floor(std::log10(range[0]))),
            std::pow(10.0, std::ceil(std::log10(range[1]) + 0.15))};
  }
  const double middle = 0.5 * (range[0] + range[1]);
  const double half =
      0.54 * std::max({range[1] - range[0], figure.least_span, 1e-9 * std::abs(middle), 1e-12});
  range = {middle - half, middle + half};
  if (figure.right_label.empty()) return range;
  const double room = 2.0 * half;  // for the other axis
  if (right_axis) {
    range[1] += room;
  } else {
    range[0] -= room;
  }
  return range;
}

void DrawFigures(const std::vector<Figure>& figures, const VectorXd& time,
                 const std::filesystem::path& folder) {
  const Thinning thinning(time, kPointsPerCurve);
  const std::filesystem::path path = folder / "figures.gnuplot";
  std::ofstream script(path);
  script << "set encoding utf8\nset datafile separator comma\nset grid lw 0.6 lc rgb '#d5dae0'\nset border 3 "
            "lw 0.8 lc rgb '#5b6570'\n"
            "set tics nomirror scale 0.5 textcolor rgb '#30363d'\nset xlabel 't (s)'\nset samples 2\n"
            "set key bmargin center horizontal samplen 2.4 spacing 1.1 width 1\nset lmargin 11\n";
  for (const Figure& figure : figures) {
    WriteData(figure, thinning, folder);
    WriteScript(figure, time, &script);
  }
  script.close();
  if (!script) throw InputError(path.string() + ": cannot be written: " + std::strerror(errno));
  RunGnuplot(folder);
  for (const Figure& figure : figures) {
    for (const char* extension : kFigureFiles) {
      const std::filesystem::path picture = folder / (figure.name + extension);
      std::error_code error;
      if (std::filesystem::file_size(picture, error) == 0 || error) {
        throw InputError(picture.string() + ": was not drawn by gnuplot");
      }
    }
  }
}

Thinning::Thinning(const VectorXd& time, long most) {
  const long rows = time.size();
  if (rows <= most) {
    times_.assign(time.data(), time.data() + rows);
    return;
  }
  const long intervals = std::max(most / 2, 1L);
  for (long i = 0; i <= intervals; ++i) starts_.push_back(i * rows / intervals);
  for (size_t i = 0; i + 1 < starts_.size(); ++i) {
    times_.push_back(time[starts_[i]]);
    times_.push_back(time[starts_[i + 1] - 1]);
  }
}

std::vector<double> Thinning::Apply(const VectorXd& values) const {
  if (keeps_all()) return {values.data(), values.data() + values.size()};
  std::vector<double> kept;
  kept.reserve(times_.size());
  for (size_t i = 0; i + 1 < starts_.size(); ++i) {
    long least = -1;
    long largest = -1;
    for (long row = starts_[i]; row < starts_[i + 1]; ++row) {
      if (!std::isfinite(values[row])) continue;
      if (least < 0 || values[row] < values[least]) least = row;
      if (largest < 0 || values[row] > values[largest]) largest = row;
    }
    if (least < 0) {
      kept.insert(kept.end(), 2, std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    if (least > largest) std::swap(least, largest);
    kept.push_back(values[least]);
    kept.push_back(values[largest]);
  }
  return kept;
}

}  // namespace dexcheck
