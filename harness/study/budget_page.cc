#include <algorithm>
#include <cmath>

#include "harness/report/page_frame.h"
#include "harness/study/error_budget.h"
#include "harness/study/explorer_assets.h"

namespace dexcheck {
namespace {

constexpr double kLabelWidth = 250.0;  // px
constexpr double kBarWidth = 420.0;
constexpr double kRightMargin = 40.0;  // half of the last decade's "1e-3 m"
constexpr double kRowHeight = 34.0;

/// A logarithmic axis of errors.
struct LogAxis {
  double least, most;  // decades
  explicit LogAxis(const ErrorBudget& budget) {
    double low = budget.all.rms, high = budget.all.rms;
    const auto include = [&](double value) {
      if (!(value > 0.0) || !std::isfinite(value)) return;
      low = std::min(low, value);
      high = std::max(high, value);
    };
    include(budget.sum.rms);
    for (const BudgetEntry& entry : budget.entries) {
      include(entry.alone.rms);
      include(entry.predicted.rms);
    }
    least = std::floor(std::log10(std::max(low, 1e-15)));
    most = std::max(std::ceil(std::log10(std::max(high, 1e-15))), least + 1.0);
  }
  [[nodiscard]] double Place(double value) const {
    if (!(value > 0.0)) return 0.0;
    return kBarWidth * std::clamp((std::log10(value) - least) / (most - least), 0.0, 1.0);
  }
};

Html DrawBar(const LogAxis& axis, double y, const std::string& name, double measured, double predicted,
             const std::string& unit, bool interacts) {
  Html bar = FormatHtml("<text x='{:.0f}' y='{:.0f}' text-anchor='end'>{}</text>", kLabelWidth - 8.0,
                        y + 15.0, name);
  bar += FormatHtml(
      "<rect x='{:.0f}' y='{:.0f}' width='{:.1f}' height='13' class='{}'><title>measured {} "
      "{}</title></rect>",
      kLabelWidth, y + 2.0, std::max(1.0, axis.Place(measured)),
      std::string(interacts ? "interacts" : "measured"), FormatShort(measured), unit);
  bar += FormatHtml(
      "<rect x='{:.0f}' y='{:.0f}' width='{:.1f}' height='7' class='predicted'><title>predicted {} "
      "{}</title></rect>",
      kLabelWidth, y + 16.0, std::max(1.0, axis.Place(predicted)), FormatShort(predicted), unit);
  return bar;
}

Html DrawChart(const ErrorBudget& budget) {
  const LogAxis axis(budget);
  const double height = kRowHeight * static_cast<double>(budget.entries.size() + 2) + 24.0;
  Html chart =
      FormatHtml("<svg class='budget' viewBox='0 0 {:.0f} {:.0f}' role='img' aria-label='error budget'>",
                 kLabelWidth + kBarWidth + kRightMargin, height);
  for (double decade = axis.least; decade <= axis.most; decade += 1.0) {
    const double x = kLabelWidth + axis.Place(std::pow(10.0, decade));
    chart += FormatHtml(
        "<line x1='{:.1f}' x2='{:.1f}' y1='0' y2='{:.0f}'/>"
        "<text x='{:.1f}' y='{:.0f}' text-anchor='middle'>1e{:.0f} {}</text>",
        x, x, height - 18.0, x, height - 4.0, decade, budget.unit);
  }
  double y = 0.0;
  for (const BudgetEntry& entry : budget.entries) {
    chart +=
        DrawBar(axis, y, entry.name, entry.alone.rms, entry.predicted.rms, budget.unit, entry.interacts());
    y += kRowHeight;
  }
  chart += DrawBar(axis, y, "sum of the above", budget.sum.rms, budget.predicted.rms, budget.unit, false);
  chart +=
      DrawBar(axis, y + kRowHeight, "all together", budget.all.rms, budget.predicted.rms, budget.unit, false);
  chart += "</svg>";
  return chart;
}

Html MakeTable(const ErrorBudget& budget) {
  Html table = HtmlLiteral(
      "<table class='numbers'><tr><th>source</th><th>alone, rms</th><th>alone, max</th><th>predicted, "
      "rms</th>"
      "<th>without it, rms</th><th>interaction</th><th></th></tr>");
  for (const BudgetEntry& e : budget.entries) {
    table += FormatHtml(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.0f} %</td><td>{}</td></tr>",
        e.name, FormatShort(e.alone.rms), FormatShort(e.alone.max), FormatShort(e.predicted.rms),
        FormatShort(e.without.rms), 100.0 * e.interaction,
        !e.failure.empty() ? e.failure : std::string(e.interacts() ? "interacts" : ""));
  }
  const auto row = [&](const std::string& name, const ErrorSize& size) {
    table += FormatHtml("<tr><td>{}</td><td>{}</td><td>{}</td><td></td><td></td><td></td><td></td></tr>",
                        name, FormatShort(size.rms), FormatShort(size.max));
  };
  row("none of them", budget.ideal);
  row("sum of the above", budget.sum);
  row("all together", budget.all);
  table += "</table>";
  return table;
}

}  // namespace

std::string MakeBudgetPage(const ErrorBudget& budget) {
  Html page = BeginPage("error budget of " + budget.scenario, Html::Raw(kStudyCss));
  page += FormatHtml("<header><h1>Error budget of <b>{}</b></h1></header><main>", budget.scenario);
  page += FormatHtml(
      "<p>RMS of {} with each source alone (blue; orange where it makes another error in company than "
      "alone), "
      "and what is predicted of it to first order (grey).</p>",
      std::string(budget.of_joints ? "the largest error of a joint" : "the object's position error"));
  if (!budget.failure.empty()) page += FormatHtml("<p><strong>{}</strong></p>", budget.failure);
  page += DrawChart(budget);
  page += MakeTable(budget);
  page += "</main></body></html>\n";
  return page.markup();
}

}  // namespace dexcheck
