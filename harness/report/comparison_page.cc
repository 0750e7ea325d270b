#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "harness/report/page.h"
#include "harness/report/page_frame.h"
#include "harness/report/run_comparison.h"

namespace dexcheck {

namespace {

/// Signals that are drawn: those that differ most.
constexpr size_t kMostPlots = 10;
/// Fractions below this are rounding, and their plots would be noise.
constexpr double kLeastFraction = 1e-15;

/// The object's error first, then the signals that differ most: overlaid, and subtracted.
std::vector<Figure> MakeFigures(const std::vector<const RunData*>& runs, const RunComparison& comparison) {
  std::vector<Figure> figures;
  const auto read = [&](size_t run, const std::string& name, int column) {
    return Resample(runs[run]->time(), runs[run]->log().ReadSignal(name).col(column), runs[0]->time());
  };
  const auto add = [&](bool subtracts, const std::string& title, const std::string& name, int column,
                       const std::string& label, bool log) {
    Figure figure{.name = (subtracts ? "difference" : "overlay") + std::to_string(figures.size()),
                  .title = title,
                  .label = label,
                  .log = log};
    for (size_t i = subtracts ? 1 : 0; i < runs.size(); ++i) {
      const SignalInfo* const signal = runs[i]->Find(name);
      if (signal == nullptr || signal->width <= column) continue;
      VectorXd values = read(i, name, column);
      if (subtracts) values -= read(0, name, column);
      figure.curves.push_back(
          {.label = static_cast<char>('A' + i % 26) + std::string(subtracts ? " - A" : ""),
           .values = values,
           .color = static_cast<int>(i),
           .dash = subtracts ? 0 : static_cast<int>(i)});
    }
    if (!figure.curves.empty()) figures.push_back(std::move(figure));
  };
  add(false, "position error of the object", "object/position_error", 0, "m", true);
  add(false, "largest error of a joint", "joints/largest_error", 0, "rad", true);
  std::vector<std::string> drawn;
  for (const SignalDifference& signal : comparison.signals) {
    if (drawn.size() == kMostPlots || signal.fraction() < kLeastFraction) break;
    if (std::ranges::find(drawn, signal.name) != drawn.end()) continue;
    drawn.push_back(signal.name);
    const std::string title = signal.NameColumn();
    const bool has_unit = signal.unit != "1";
    add(false, title, signal.name, signal.column_index, has_unit ? signal.unit : signal.name, false);
    add(true, title + ", difference", signal.name, signal.column_index, has_unit ? signal.unit : "difference",
        false);
  }
  return figures;
}

}  // namespace

std::string MakeComparisonPage(const std::vector<const RunData*>& runs, const std::vector<std::string>& names,
                               const RunComparison& comparison) {
  const std::vector<Figure> figures = MakeFigures(runs, comparison);
  const PlotGroup plots = {"", figures, runs[0]->time()};
  return AssemblePlotPage(fmt::format("Comparison of {}", fmt::join(names, ", ")), kComparisonJs,
                          EmbedJson("comparison", ToJson(comparison, names)), {&plots, 1});
}

std::string MakeCampaignPage(const nlohmann::ordered_json& campaign) {
  return AssemblePage({.title = "faults made on purpose",
                       .styles = {},
                       .markup = {kPageHtml},
                       .data = EmbedJson("campaign-data", campaign),
                       .scripts = {kCampaignJs}});
}

}  // namespace dexcheck
