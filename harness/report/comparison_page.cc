#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "harness/report/page.h"
#include "harness/report/page_frame.h"
#include "harness/report/run_comparison.h"

namespace dexcheck {

namespace {

using Json = nlohmann::ordered_json;

/// Signals that are drawn: those that differ most.
constexpr size_t kMostPlots = 10;
/// Fractions below this are rounding, and their plots would be noise.
constexpr double kLeastFraction = 1e-15;

std::string Letter(size_t run) { return std::string(1, static_cast<char>('A' + run % 26)); }

class ComparisonPage {
 public:
  ComparisonPage(const std::vector<const RunData*>& runs, const std::vector<std::string>& names,
                 const RunComparison& comparison)
      : runs_(runs), names_(names), comparison_(comparison) {}

  std::string Make() {
    const SignalDifference* const first = comparison_.FindFirst();
    Json json = {
        {"names", names_},
        {"verdicts", comparison_.verdicts},
        {"same", comparison_.IsSame()},
        {"first",
         first == nullptr ? Json() : Json{{"name", first->NameColumn()}, {"time", first->first_time}}},
        {"inputs", Json::array()},
        {"results", ShowNumbers(comparison_.results)},
        {"checks", ShowNumbers(comparison_.checks)},
        {"signals", Json::array()},
        {"not_compared", comparison_.not_compared}};
    for (const InputDifference& input : comparison_.inputs)
      json["inputs"].push_back({{"name", input.name}, {"values", input.values}});
    for (const SignalDifference& signal : comparison_.signals) {
      json["signals"].push_back({{"name", signal.NameColumn()},
                                 {"run", signal.run},
                                 {"differs", signal.differs},
                                 {"difference", FormatShort(signal.difference) + " " + signal.unit},
                                 {"fraction", FormatShort(signal.fraction())},
                                 {"at", signal.at_time}});
    }
    const std::vector<Figure> figures = MakeFigures();
    const PlotGroup plots = {"", figures, runs_[0]->time()};
    return AssemblePlotPage(fmt::format("Comparison of {}", fmt::join(names_, ", ")), kComparisonJs,
                            EmbedJson("comparison", json), {&plots, 1});
  }

 private:
  static Json ShowNumbers(const std::vector<ComparedNumber>& numbers) {
    Json list = Json::array();
    for (const ComparedNumber& number : numbers) {
      Json json = {{"name", number.name},
                   {"values", Json::array()},
                   {"fails", number.fails},
                   {"ratios", Json::array()},
                   {"is_zero", !number.fails_anywhere()}};
      for (const std::optional<double>& value : number.values) {
        const std::string unit = number.unit == "1" ? "" : " " + number.unit;
        json["values"].push_back(value ? FormatShort(*value) + unit : "–");
        if (value != 0.0) json["is_zero"] = false;
      }
      for (size_t i = 1; i < number.values.size(); ++i) {
        const std::optional<double> ratio = number.CalcRatio(i);
        json["ratios"].push_back(ratio ? FormatShort(*ratio) : "–");
      }
      list.push_back(json);
    }
    return list;
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
      if (std::ranges::find(drawn, signal.name) != drawn.end()) continue;
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

std::string MakeCampaignPage(const nlohmann::ordered_json& campaign) {
  return AssemblePage({.title = "faults made on purpose",
                       .styles = {},
                       .markup = {kPageHtml},
                       .data = EmbedJson("campaign-data", campaign),
                       .scripts = {kCampaignJs}});
}

}  // namespace dexcheck
