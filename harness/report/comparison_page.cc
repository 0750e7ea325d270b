#include "harness/report/comparison_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/report/html.h"
#include "harness/report/page_frame.h"

namespace dexcheck {
namespace {

/// Signals that are drawn: those that differ most.
constexpr size_t kMostPlots = 10;
/// Fractions below this are rounding, and their plots would be noise.
constexpr double kLeastFraction = 1e-15;

std::string Letter(size_t run) { return std::string(1, static_cast<char>('A' + run % 26)); }

class ComparisonPage : public PageBuilder {
 public:
  ComparisonPage(const std::vector<const RunData*>& runs, const std::vector<std::string>& names,
                 const RunComparison& comparison)
      : runs_(runs), names_(names), comparison_(comparison) {}

  std::string Make() {
    html_ += BeginPlotPage(fmt::format("Comparison of {}", fmt::join(names_, ", ")));
    AddHeader();
    html_ += "<main>\n";
    AddInputs();
    if (!comparison_.results.empty()) {
      html_ += "<h2 id=\"results\">Results</h2>\n<div class=\"card scroll\">\n";
      AddNumbers(comparison_.results);
      html_ += "</div>\n";
    }
    AddChecks();
    AddSignals();
    const std::vector<Figure> figures = MakeFigures();
    html_ += MakePlotSection(figures);
    html_ +=
        "</main>\n<footer>Made by dexcheck from the runs' logs. Plots by dygraphs (MIT license).</footer>\n";
    html_ += EndPage(figures, runs_[0]->time());
    return html_.markup();
  }

 private:
  void AddHeader() {
    const bool same = comparison_.IsSame();
    Add("<header>\n<h1><b>Comparison</b> of {} runs</h1>\n<section class=\"verdict {}\" id=\"verdict\">"
        "<strong>{}</strong>",
        runs_.size(), same ? "pass" : "open", same ? "SAME" : "DIFFERENT");
    for (size_t i = 0; i < runs_.size(); ++i)
      Add("<p><b>{}</b> <code>{}</code>: {}</p>", Letter(i), names_[i], comparison_.verdicts[i]);
    if (const SignalDifference* first = comparison_.FindFirst()) {
      Add("<p>The first signal that differs is <code>{}</code>, at {:.3f} s.</p>", first->NameColumn(),
          first->first_time);
    }
    html_ += "</section>\n</header>\n";
    html_ += MakeNavigation({"Verdict", "Inputs", "Results", "Checks", "Signals", "Plots"});
  }

  /// A header cell for each run from the first on. @param ending of each.
  void AddHeaderCells(size_t first, const char* ending) {
    for (size_t i = first; i < runs_.size(); ++i) Add("<th class=\"value\">{}{}</th>", Letter(i), ending);
  }

  void AddInputs() {
    html_ += "<h2 id=\"inputs\">Inputs that differ</h2>\n<div class=\"card scroll\">\n";
    if (comparison_.inputs.empty()) {
      html_ +=
          "<p>None: scenario, overrides, parameters, MJCF, versions and machine are the same.</p></div>\n";
      return;
    }
    html_ += "<table><thead><tr><th>input</th>";
    for (size_t i = 0; i < runs_.size(); ++i) Add("<th>{}</th>", Letter(i));
    html_ += "</tr></thead><tbody>\n";
    for (const InputDifference& input : comparison_.inputs) {
      Add("<tr><td><code>{}</code></td>", input.name);
      for (const std::string& value : input.values) Add("<td>{}</td>", value.empty() ? "none" : value);
      html_ += "</tr>\n";
    }
    html_ += "</tbody></table></div>\n";
  }

  /// Those that fail first; constants that agree exactly in all runs are folded.
  void AddChecks() {
    std::vector<ComparedNumber> shown = comparison_.checks;
    std::stable_partition(shown.begin(), shown.end(), std::mem_fn(&ComparedNumber::fails_anywhere));
    const auto zeros = std::stable_partition(shown.begin(), shown.end(), [](const ComparedNumber& check) {
      const auto is_zero = [](const std::optional<double>& value) { return value == 0.0; };
      return check.fails_anywhere() || !std::all_of(check.values.begin(), check.values.end(), is_zero);
    });
    if (shown.empty()) return;
    html_ += "<h2 id=\"checks\">Checks</h2>\n<div class=\"card scroll\">\n";
    if (zeros != shown.begin()) AddNumbers({shown.begin(), zeros});
    if (zeros != shown.end()) {
      const auto count = shown.end() - zeros;
      Add("<details><summary>{} check{} 0 in all runs</summary>\n", count, count == 1 ? " is" : "s are");
      AddNumbers({zeros, shown.end()});
      html_ += "</details>\n";
    }
    html_ += "</div>\n";
  }

  void AddNumbers(const std::vector<ComparedNumber>& numbers) {
    html_ += "<table><thead><tr><th></th>";
    AddHeaderCells(0, "");
    AddHeaderCells(1, " / A");
    html_ += "</tr></thead><tbody>\n";
    for (const ComparedNumber& number : numbers) {
      Add("<tr class=\"{}\"><td>{}</td>", number.fails_anywhere() ? "fail" : "pass", number.name);
      for (size_t i = 0; i < runs_.size(); ++i) {
        const std::string unit = number.unit == "1" ? "" : " " + number.unit;
        const std::string value = number.values[i] ? FormatShort(*number.values[i]) + unit : "–";
        Add("<td class=\"value number\">{}</td>",
            number.fails[i] ? FormatHtml("<span class=\"badge\">{}</span>", value) : Html::Text(value));
      }
      for (size_t i = 1; i < runs_.size(); ++i) {
        const std::optional<double> ratio = number.CalcRatio(i);
        Add("<td class=\"value number\">{}</td>", ratio ? FormatShort(*ratio) : "–");
      }
      html_ += "</tr>\n";
    }
    html_ += "</tbody></table>\n";
  }

  void AddSignals() {
    html_ +=
        "<h2 id=\"signals\">Signals</h2>\n<div class=\"card scroll\">\n"
        "<table><thead><tr><th>signal</th><th></th><th class=\"value\">largest difference</th>"
        "<th class=\"value\">of its size</th><th class=\"value\">at</th></tr></thead><tbody>\n";
    for (const SignalDifference& signal : comparison_.signals) {
      Add("<tr class=\"{}\"><td><code>{}</code></td><td>{} - A</td><td class=\"value number\">{} {}</td>"
          "<td class=\"value number\">{}</td><td class=\"value number\">{:.3f} s</td></tr>\n",
          signal.differs ? "open" : "pass", signal.NameColumn(), Letter(signal.run),
          FormatShort(signal.difference), signal.unit, FormatShort(signal.fraction()), signal.at_time);
    }
    html_ += "</tbody></table>\n";
    if (!comparison_.not_compared.empty()) {
      html_ += "<p class=\"soft\">Not in all runs, or with other columns:";
      for (const std::string& name : comparison_.not_compared) Add(" <code>{}</code>", name);
      html_ += "</p>\n";
    }
    html_ += "</div>\n";
  }

  /// The object's error first, then the signals that differ most: overlaid, and subtracted.
  std::vector<Figure> MakeFigures() const {
    std::vector<Figure> figures;
    const auto add = [&](const char* kind, const std::string& title, const std::string& name, int column,
                         const std::string& label, bool log) {
      const bool subtracts = std::string_view(kind) == "difference";
      Figure figure{
          .name = kind + std::to_string(figures.size()), .title = title, .label = label, .log = log};
      for (size_t i = subtracts ? 1 : 0; i < runs_.size(); ++i) {
        const SignalInfo* const signal = runs_[i]->Find(name);
        if (signal == nullptr || signal->width <= column) continue;
        VectorXd values = ReadColumn(i, name, column);
        if (subtracts) values -= ReadColumn(0, name, column);
        figure.curves.push_back({.label = Letter(i) + (subtracts ? " - A" : ""),
                                 .values = values,
                                 .color = static_cast<int>(i),
                                 .dash = subtracts ? 0 : static_cast<int>(i)});
      }
      if (!figure.curves.empty()) figures.push_back(std::move(figure));
    };
    add("overlay", "position error of the object", "object/position_error", 0, "m", true);
    add("overlay", "largest error of a joint", "joints/largest_error", 0, "rad", true);
    std::vector<std::string> drawn;
    for (const SignalDifference& signal : comparison_.signals) {
      if (drawn.size() == kMostPlots || signal.fraction() < kLeastFraction) break;
      if (std::find(drawn.begin(), drawn.end(), signal.name) != drawn.end()) continue;
      drawn.push_back(signal.name);
      const std::string title = signal.NameColumn();
      const bool has_unit = signal.unit != "1";
      add("overlay", title, signal.name, signal.column_index, has_unit ? signal.unit : signal.name, false);
      add("difference", title + ", difference", signal.name, signal.column_index,
          has_unit ? signal.unit : "difference", false);
    }
    return figures;
  }

  VectorXd ReadColumn(size_t run, const std::string& name, int column) const {
    const RowMatrixXd values = runs_[run]->log().ReadSignal(name);
    return Resample(runs_[run]->time(), values.col(column), runs_[0]->time());
  }

  const std::vector<const RunData*>& runs_;
  const std::vector<std::string>& names_;
  const RunComparison& comparison_;
};

}  // namespace

std::string MakeComparisonPage(const std::vector<const RunData*>& runs, const std::vector<std::string>& names,
                               const RunComparison& comparison) {
  return ComparisonPage(runs, names, comparison).Make();
}

std::string DescribeComparison(const RunComparison& comparison, double tolerance) {
  const size_t count = comparison.signals.size();
  if (count == 0) return "NOT COMPARED: no signal but time and checks is in all runs.";
  if (comparison.IsSame()) {
    return tolerance == 0.0
               ? fmt::format("SAME: {} signals are equal bit for bit.", count)
               : fmt::format("SAME: {} signals differ by at most {:g} of their size.", count, tolerance);
  }
  const SignalDifference* const first = comparison.FindFirst();
  if (first == nullptr) return "DIFFERENT: verdict or duration.";
  const auto differing = std::count_if(comparison.signals.begin(), comparison.signals.end(),
                                       [](const SignalDifference& signal) { return signal.differs; });
  return fmt::format("DIFFERENT: {} of {} signals, first {} at {:.3f} s.", differing, count,
                     first->NameColumn(), first->first_time);
}

}  // namespace dexcheck
