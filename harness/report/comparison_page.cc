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

std::string NameColumn(const SignalDifference& signal) {
  return signal.column.empty() ? signal.name : signal.name + "." + signal.column;
}

class ComparisonPage {
 public:
  ComparisonPage(const std::vector<const RunData*>& runs, const std::vector<std::string>& names,
                 const RunComparison& comparison)
      : runs_(runs), names_(names), comparison_(comparison) {}

  std::string Make() {
    std::string title;
    for (const std::string& name : names_) title += (title.empty() ? "" : ", ") + name;
    html_ += BeginPlotPage("Comparison of " + title);
    AddHeader();
    html_ += "<main>\n";
    AddInputs();
    AddResults();
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
  template <typename... Arguments>
  void Add(fmt::format_string<html_detail::Shown<Arguments>...> format, const Arguments&... arguments) {
    html_ += FormatHtml(format, arguments...);
  }

  void AddHeader() {
    const bool same = comparison_.IsSame();
    Add("<header>\n<h1><b>Comparison</b> of {} runs</h1>\n<section class=\"verdict {}\" id=\"verdict\">"
        "<strong>{}</strong>",
        runs_.size(), same ? "pass" : "open", same ? "SAME" : "DIFFERENT");
    for (size_t i = 0; i < runs_.size(); ++i)
      Add("<p><b>{}</b> <code>{}</code>: {}</p>", Letter(i), names_[i], comparison_.verdicts[i]);
    if (const SignalDifference* first = comparison_.FindFirst()) {
      Add("<p>The first signal that differs is <code>{}</code>, at {:.3f} s.</p>", NameColumn(*first),
          first->first_time);
    }
    html_ +=
        "</section>\n</header>\n<nav><div><a href=\"#verdict\">Verdict</a><a href=\"#inputs\">Inputs</a>"
        "<a href=\"#results\">Results</a><a href=\"#checks\">Checks</a><a href=\"#signals\">Signals</a>"
        "<a href=\"#plots\">Plots</a></div></nav>\n";
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

  void AddResults() {
    if (comparison_.results.empty()) return;
    html_ += "<h2 id=\"results\">Results</h2>\n<div class=\"card scroll\">\n";
    AddNumbers(comparison_.results);
    html_ += "</div>\n";
  }

  /// Those that fail first; constants that agree exactly in all runs are folded.
  void AddChecks() {
    std::vector<ComparedNumber> failing, others, zeros;
    for (const ComparedNumber& check : comparison_.checks) {
      const auto is_zero = [](const std::optional<double>& value) { return value == 0.0; };
      const bool fails = std::find(check.fails.begin(), check.fails.end(), true) != check.fails.end();
      const bool all_zero = std::all_of(check.values.begin(), check.values.end(), is_zero);
      (fails ? failing : all_zero ? zeros : others).push_back(check);
    }
    failing.insert(failing.end(), others.begin(), others.end());
    if (failing.empty() && zeros.empty()) return;
    html_ += "<h2 id=\"checks\">Checks</h2>\n<div class=\"card scroll\">\n";
    if (!failing.empty()) AddNumbers(failing);
    if (!zeros.empty()) {
      Add("<details><summary>{} check{} 0 in all runs</summary>\n", zeros.size(),
          zeros.size() == 1 ? " is" : "s are");
      AddNumbers(zeros);
      html_ += "</details>\n";
    }
    html_ += "</div>\n";
  }

  void AddNumbers(const std::vector<ComparedNumber>& numbers) {
    html_ += "<table><thead><tr><th></th>";
    for (size_t i = 0; i < runs_.size(); ++i) Add("<th class=\"value\">{}</th>", Letter(i));
    for (size_t i = 1; i < runs_.size(); ++i) Add("<th class=\"value\">{} / A</th>", Letter(i));
    html_ += "</tr></thead><tbody>\n";
    for (const ComparedNumber& number : numbers) {
      const bool fails = std::find(number.fails.begin(), number.fails.end(), true) != number.fails.end();
      Add("<tr class=\"{}\"><td>{}</td>", fails ? "fail" : "pass", number.name);
      for (size_t i = 0; i < runs_.size(); ++i) {
        const std::string value = !number.values[i] ? "–"
                                                    : FormatShort(*number.values[i]) +
                                                          (number.unit == "1" ? "" : " " + number.unit);
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
        "<table><thead><tr><th>signal</th><th></th>"
        "<th class=\"value\">largest difference</th><th class=\"value\">of its size</th>"
        "<th class=\"value\">at</th></tr></thead><tbody>\n";
    for (const SignalDifference& signal : comparison_.signals) {
      Add("<tr class=\"{}\"><td><code>{}</code></td><td>{} - A</td><td class=\"value number\">{} {}</td>"
          "<td class=\"value number\">{}</td><td class=\"value number\">{:.3f} s</td></tr>\n",
          signal.differs ? "open" : "pass", NameColumn(signal), Letter(signal.run),
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
    AddOverlay("object/position_error", 0, "position error of the object", "m", /*log=*/true, &figures);
    AddOverlay("joints/largest_error", 0, "largest error of a joint", "rad", /*log=*/true, &figures);
    std::vector<std::string> drawn;
    for (const SignalDifference& signal : comparison_.signals) {
      if (drawn.size() == kMostPlots || signal.fraction() < kLeastFraction) break;
      if (std::find(drawn.begin(), drawn.end(), signal.name) != drawn.end()) continue;
      drawn.push_back(signal.name);
      AddOverlay(signal.name, signal.column_index, NameColumn(signal), signal.unit, /*log=*/false, &figures);
      AddDifference(signal, &figures);
    }
    return figures;
  }

  VectorXd ReadColumn(size_t run, const std::string& name, int column) const {
    const RowMatrixXd values = runs_[run]->log().ReadSignal(name);
    return Resample(runs_[run]->time(), values.col(column), runs_[0]->time());
  }

  void AddOverlay(const std::string& name, int column, const std::string& title, const std::string& unit,
                  bool log, std::vector<Figure>* figures) const {
    Figure figure;
    figure.name = fmt::format("overlay{}", figures->size());
    figure.title = title;
    figure.label = unit == "1" ? name : unit;
    figure.log = log;
    for (size_t i = 0; i < runs_.size(); ++i) {
      const SignalInfo* const signal = runs_[i]->Find(name);
      if (signal == nullptr || signal->width <= column) continue;
      figure.curves.push_back(
          {Letter(i), ReadColumn(i, name, column), static_cast<int>(i), static_cast<int>(i)});
    }
    if (!figure.curves.empty()) figures->push_back(std::move(figure));
  }

  void AddDifference(const SignalDifference& difference, std::vector<Figure>* figures) const {
    Figure figure;
    figure.name = fmt::format("difference{}", figures->size());
    figure.title = NameColumn(difference) + ", difference";
    figure.label = difference.unit == "1" ? "difference" : difference.unit;
    const VectorXd first = ReadColumn(0, difference.name, difference.column_index);
    for (size_t i = 1; i < runs_.size(); ++i) {
      const SignalInfo* const signal = runs_[i]->Find(difference.name);
      if (signal == nullptr || signal->width <= difference.column_index) continue;
      figure.curves.push_back({Letter(i) + " - A",
                               ReadColumn(i, difference.name, difference.column_index) - first,
                               static_cast<int>(i), 0});
    }
    figures->push_back(std::move(figure));
  }

  const std::vector<const RunData*>& runs_;
  const std::vector<std::string>& names_;
  const RunComparison& comparison_;
  Html html_;
};

}  // namespace

std::string MakeComparisonPage(const std::vector<const RunData*>& runs, const std::vector<std::string>& names,
                               const RunComparison& comparison) {
  return ComparisonPage(runs, names, comparison).Make();
}

std::string DescribeComparison(const RunComparison& comparison, double tolerance) {
  if (comparison.signals.empty()) return "NOT COMPARED: no signal but time and checks is in all runs.";
  if (comparison.IsSame()) {
    return tolerance == 0.0
               ? fmt::format("SAME: {} signals are equal bit for bit.", comparison.signals.size())
               : fmt::format("SAME: {} signals differ by at most {:g} of their size.",
                             comparison.signals.size(), tolerance);
  }
  const auto differing = std::count_if(comparison.signals.begin(), comparison.signals.end(),
                                       [](const SignalDifference& signal) { return signal.differs; });
  const SignalDifference* const first = comparison.FindFirst();
  if (first == nullptr) return "DIFFERENT: verdict or duration.";
  return fmt::format("DIFFERENT: {} of {} signals, first {} at {:.3f} s.", differing,
                     comparison.signals.size(), NameColumn(*first), first->first_time);
}

}  // namespace dexcheck
