#include "harness/study/study_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <regex>

#include "controller/common/text.h"
#include "harness/report/html.h"
#include "harness/study/study_charts.h"
#include "harness/study/study_theory.h"

namespace dexcheck {
namespace {

constexpr std::array<const char*, kNumOutcomes> kOutcomeColors = {"#7bb662", "#f2c14e", "#e4572e", "#f78154",
                                                                  "#9b2226", "#577590", "#cccccc", "#000000"};
constexpr const char* kTheoryColor = "#0b3c8c";
constexpr const char* kDampingColor = "#ffffff";
constexpr size_t kMostBest = 20;
constexpr size_t kMostLines = 6;

constexpr const char* kStyle = R"(<style>
body { font: 15px/1.45 sans-serif; margin: 2em auto; max-width: 1200px; padding: 0 1em; color: #222; }
svg { font: 12px sans-serif; } svg .title { font-weight: bold; font-size: 13px; } svg .tick { font-size: 11px; }
svg .edge { stroke: #000; stroke-width: 3; } svg .frame { fill: #fafafa; stroke: #999; }
figure { display: inline-block; margin: 0 0.5em 1em 0; }
table { border-collapse: collapse; } td, th { padding: 2px 9px; border-bottom: 1px solid #ddd; text-align: right; }
td.text, th.text { text-align: left; } pre { white-space: pre-wrap; background: #f4f4f4; padding: 4px 8px; margin: 3px 0; }
pre:target { background: #fff3c4; } .key { display: inline-block; width: 1em; height: 1em; vertical-align: -2px; }
</style>
)";

bool IsHeld(Outcome outcome) {
  return outcome == Outcome::kTracked || outcome == Outcome::kSlipped || outcome == Outcome::kWheelsSpun ||
         outcome == Outcome::kChecksDisagreed;
}

std::string QuoteForShell(const std::string& word) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./,:";
  if (word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

class Report {
 public:
  explicit Report(const StudyStore& store) : store_(&store), study_(store.study()), rows_(store.ReadRows()) {
    inputs_.study = study_;
    inputs_.scenario_text = store.Identify("scenario");
    inputs_.scenario_source = study_.scenario;
    metrics_ = ChooseMetrics();
  }

  std::string Make() {
    std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<title>" +
                       EscapeHtml(study_.name) + "</title>\n" + kStyle + "</head>\n<body>\n";
    html += Head();
    if (rows_.empty()) return html + "<p>No trial is done yet.</p>\n</body>\n</html>\n";
    html += Outcomes();
    html += Maps();
    html += Lines();
    html += ErrorAgainstEffort();
    html += Best();
    html += Commands();
    return html + "</body>\n</html>\n";
  }

 private:
  [[nodiscard]] std::vector<Metric> ChooseMetrics() const {
    if (study_.metrics.empty()) return {kPositionErrorRms, kPeakEffort, kConeMargin};
    std::vector<Metric> metrics;
    for (const std::string& name : study_.metrics) {
      for (size_t i = 0; i < kMetrics.size(); ++i) {
        if (kMetrics[i].name == name) metrics.push_back(static_cast<Metric>(i));
      }
    }
    return metrics;
  }

  [[nodiscard]] static std::string Label(Metric metric) {
    return fmt::format("{}, {}", kMetrics[metric].name, kMetrics[metric].unit);
  }

  [[nodiscard]] static std::string LinkTo(const TrialRow& row) {
    return fmt::format("#trial-{}", row.trial.number);
  }

  [[nodiscard]] std::string Describe(const TrialRow& row) const {
    std::string text = fmt::format("trial {}: ", row.trial.number);
    for (size_t i = 0; i < study_.variations.size(); ++i) {
      text += fmt::format("{} = {:.6g}, ", study_.variations[i].key, row.trial.parameters[i]);
    }
    text += NameOf(row.result.outcome);
    if (!row.result.failure.empty()) text += ": " + row.result.failure;
    return text;
  }

  [[nodiscard]] std::string Head() const {
    return fmt::format(
        "<h1>{}</h1>\n<p>{}</p>\n<p>Scenario {}, {} of {} trials. dexcheck {}{}{}, MuJoCo {}.</p>\n",
        EscapeHtml(study_.name), EscapeHtml(study_.description), EscapeHtml(study_.scenario), rows_.size(),
        ListTrials(study_).size(), store_->Identify("dexcheck_version"),
        store_->Identify("git_revision").empty() ? "" : ", revision ",
        EscapeHtml(store_->Identify("git_revision")), store_->Identify("mujoco_version"));
  }

  [[nodiscard]] std::string Outcomes() const {
    std::map<Outcome, long> counts;
    for (const TrialRow& row : rows_) ++counts[row.result.outcome];
    std::string html = "<h2>Outcomes</h2>\n<table>\n";
    for (const auto& [outcome, count] : counts) {
      html += fmt::format(
          "<tr><td class=\"text\"><span class=\"key\" style=\"background:{}\"></span> "
          "{}</td><td>{}</td></tr>\n",
          kOutcomeColors[static_cast<size_t>(outcome)], NameOf(outcome), count);
    }
    return html + "</table>\n" + Departures();
  }

  /// Where theory is stable and the run was not held to its end, by reason.
  [[nodiscard]] std::string Departures() const {
    std::map<std::string, long> reasons;
    long agree = 0;
    for (const TrialRow& row : rows_) {
      if (row.result.outcome == Outcome::kRefused) continue;
      const bool stable = IsStableInTheory(inputs_, row.trial.parameters);
      if (stable == IsHeld(row.result.outcome)) {
        ++agree;
        continue;
      }
      static const std::regex kTime("( at t = .*| while settling)$");
      std::string reason = std::regex_replace(row.result.failure, kTime, "");
      if (reason.empty()) reason = "the error grew";
      ++reasons[stable ? "stable in theory, but " + reason
                       : "unstable in theory, but held to the end of the run"];
    }
    std::string html = fmt::format(
        "<p>The sampled error dynamics E_ddot + K_v E_dot + K_p E = 0, stepped as the engine steps, tell {} "
        "of {} "
        "trials rightly. Where the plant departs from them, and why:</p>\n<table>\n",
        agree, rows_.size());
    for (const auto& [reason, count] : reasons) {
      html += fmt::format("<tr><td class=\"text\">{}</td><td>{}</td></tr>\n", EscapeHtml(reason), count);
    }
    return html + "</table>\n";
  }

  [[nodiscard]] bool IsGrid() const {
    return study_.sampling == Sampling::kGrid && study_.variations.size() >= 2;
  }

  [[nodiscard]] static Axis AxisOf(const Variation& variation) {
    Axis axis{variation.key, variation.values, false};
    std::sort(axis.values.begin(), axis.values.end());
    const double first = axis.values.front();
    axis.logarithmic = first > 0.0 && axis.values.back() / first > 10.0;
    return axis;
  }

  /// The worst trial of each cell of the first two keys, by what `is_worse` says.
  [[nodiscard]] std::vector<const TrialRow*> WorstOfCells(
      const Axis& x, const Axis& y,
      const std::function<bool(const TrialRow&, const TrialRow&)>& is_worse) const {
    std::vector<const TrialRow*> cells(x.values.size() * y.values.size(), nullptr);
    const auto find = [](const Axis& axis, double value) {
      return static_cast<size_t>(std::lower_bound(axis.values.begin(), axis.values.end(), value) -
                                 axis.values.begin());
    };
    for (const TrialRow& row : rows_) {
      const size_t cell =
          find(y, row.trial.parameters[1]) * x.values.size() + find(x, row.trial.parameters[0]);
      if (cells[cell] == nullptr || is_worse(row, *cells[cell])) cells[cell] = &row;
    }
    return cells;
  }

  [[nodiscard]] std::string Maps() const {
    if (!IsGrid()) return SampleMaps();
    const Axis x = AxisOf(study_.variations[0]);
    const Axis y = AxisOf(study_.variations[1]);
    HeatMap map{"outcome", x, y, {}, true, {}};
    const auto cells = WorstOfCells(x, y, [](const TrialRow& a, const TrialRow& b) {
      return IsHeld(a.result.outcome) < IsHeld(b.result.outcome) ||
             (IsHeld(a.result.outcome) == IsHeld(b.result.outcome) && a.result.outcome > b.result.outcome);
    });
    for (const TrialRow* row : cells) {
      map.cells.push_back(row == nullptr
                              ? HeatCell{}
                              : HeatCell{kOutcomeColors[static_cast<size_t>(row->result.outcome)],
                                         Describe(*row), LinkTo(*row), IsHeld(row->result.outcome)});
    }
    const std::vector<double>& parameters = rows_.front().trial.parameters;
    map.overlays = {{kTheoryColor, FindTurns(inputs_, parameters, IsStableInTheory)},
                    {kDampingColor, FindTurns(inputs_, parameters, IsDampedInTheory)}};
    std::string html =
        "<h2>Over the first two keys</h2>\n<p>Black lines: the measured boundary between runs that were held "
        "to "
        "their end and others. Blue dots: the theoretical boundary of stability; white dots: critical "
        "damping. "
        "Of several trials in one cell the worst is shown. A cell leads to its trial's command.</p>\n" +
        DrawHeatMap(map);
    for (const Metric metric : metrics_) html += MetricMap(metric, x, y);
    return html;
  }

  [[nodiscard]] std::string MetricMap(Metric metric, const Axis& x, const Axis& y) const {
    const double sign = metric == kConeMargin ? -1.0 : 1.0;  // a small margin is the worse
    const auto cells = WorstOfCells(x, y, [&](const TrialRow& a, const TrialRow& b) {
      return !(sign * a.result.metrics[metric] <= sign * b.result.metrics[metric]);
    });
    const auto is_shown = [&](const TrialRow* row) {
      return row != nullptr && IsHeld(row->result.outcome) && std::isfinite(row->result.metrics[metric]);
    };
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (const TrialRow* row : cells) {
      if (!is_shown(row)) continue;
      least = std::min(least, row->result.metrics[metric]);
      most = std::max(most, row->result.metrics[metric]);
    }
    HeatMap map{Label(metric), x, y, {}, false, {}};
    if (least <= most) map.title += fmt::format(": {:.3g} (pale) to {:.3g} (dark)", least, most);
    for (const TrialRow* row : cells) {
      const double value = is_shown(row) ? row->result.metrics[metric] : std::nan("");
      map.cells.push_back(row == nullptr ? HeatCell{}
                                         : HeatCell{ColorOf(value, least, most),
                                                    fmt::format("{:.4g}; {}", value, Describe(*row)),
                                                    LinkTo(*row), true});
    }
    return DrawHeatMap(map);
  }

  /// For samples: where they lie.
  [[nodiscard]] std::string SampleMaps() const {
    if (study_.variations.size() < 2) return "";
    Chart chart{
        "outcome", {study_.variations[0].key, {}, false}, {study_.variations[1].key, {}, false}, {}, {}};
    for (const TrialRow& row : rows_) {
      chart.points.push_back({row.trial.parameters[0], row.trial.parameters[1],
                              kOutcomeColors[static_cast<size_t>(row.result.outcome)], Describe(row),
                              LinkTo(row)});
    }
    return "<h2>Over the first two keys</h2>\n" + DrawChart(chart);
  }

  /// Metrics along the first key, a line for each of a few values of the second.
  [[nodiscard]] std::string Lines() const {
    if (study_.sampling != Sampling::kGrid) return "";
    std::vector<double> chosen = {0.0};
    const bool has_second = study_.variations.size() > 1;
    if (has_second) {
      const std::vector<double>& all = study_.variations[1].values;
      const size_t count = std::min(all.size(), kMostLines);
      chosen.clear();
      for (size_t i = 0; i < count; ++i) {
        chosen.push_back(all[count > 1 ? i * (all.size() - 1) / (count - 1) : 0]);
      }
    }
    std::string html = "<h2>Along " + EscapeHtml(study_.variations[0].key) + "</h2>\n";
    for (const Metric metric : metrics_) {
      Chart chart{Label(metric), {study_.variations[0].key, {}, false}, {Label(metric), {}, false}, {}, {}};
      for (size_t i = 0; i < chosen.size(); ++i) {
        const double share =
            chosen.size() > 1 ? static_cast<double>(i) / static_cast<double>(chosen.size() - 1) : 1.0;
        ChartLine line;
        line.color = ColorOf(0.3 + 0.7 * share, 0.0, 1.0);
        if (has_second) line.label = fmt::format("{} = {:.3g}", study_.variations[1].key, chosen[i]);
        for (const TrialRow& row : rows_) {
          const bool mine = (!has_second || row.trial.parameters[1] == chosen[i]) &&
                            IsHeld(row.result.outcome) && std::isfinite(row.result.metrics[metric]);
          if (mine) line.points.emplace_back(row.trial.parameters[0], row.result.metrics[metric]);
        }
        std::sort(line.points.begin(), line.points.end());
        if (!line.points.empty()) chart.lines.push_back(line);
      }
      if (!chart.lines.empty()) html += DrawChart(chart);
    }
    return html;
  }

  [[nodiscard]] std::vector<const TrialRow*> ListTracked() const {
    std::vector<const TrialRow*> tracked;
    for (const TrialRow& row : rows_) {
      if (row.result.outcome == Outcome::kTracked) tracked.push_back(&row);
    }
    std::stable_sort(tracked.begin(), tracked.end(), [](const TrialRow* a, const TrialRow* b) {
      return a->result.metrics[kPositionErrorRms] < b->result.metrics[kPositionErrorRms];
    });
    return tracked;
  }

  /// From the least error on, those that need less work than all before.
  [[nodiscard]] std::vector<const TrialRow*> ListFront() const {
    std::vector<const TrialRow*> front;
    for (const TrialRow* row : ListTracked()) {
      if (front.empty() || row->result.metrics[kEnergy] < front.back()->result.metrics[kEnergy]) {
        front.push_back(row);
      }
    }
    return front;
  }

  [[nodiscard]] std::string ErrorAgainstEffort() const {
    Chart chart{
        "error against effort", {Label(kEnergy), {}, false}, {Label(kPositionErrorRms), {}, false}, {}, {}};
    ChartLine line{"Pareto front", "#9b2226", {}};
    for (const TrialRow* row : ListFront()) {
      line.points.emplace_back(row->result.metrics[kEnergy], row->result.metrics[kPositionErrorRms]);
    }
    for (const TrialRow* row : ListTracked()) {
      chart.points.push_back({row->result.metrics[kEnergy], row->result.metrics[kPositionErrorRms], "#7bb662",
                              Describe(*row), LinkTo(*row)});
    }
    if (chart.points.empty()) return "";
    chart.lines.push_back(line);
    return "<h2>Error against effort</h2>\n<p>Trials that tracked. On the front nothing can be had for less "
           "work.</p>\n" +
           DrawChart(chart);
  }

  [[nodiscard]] std::string Best() const {
    const std::vector<const TrialRow*> tracked = ListTracked();
    if (tracked.empty()) return "";
    std::string html =
        "<h2>Best</h2>\n<p>By rms position error, of the trials that "
        "tracked.</p>\n<table>\n<tr><th>trial</th>";
    for (const Variation& variation : study_.variations) html += "<th>" + EscapeHtml(variation.key) + "</th>";
    std::vector<Metric> shown = {kPositionErrorRms, kEnergy};
    for (const Metric metric : metrics_) {
      if (std::find(shown.begin(), shown.end(), metric) == shown.end()) shown.push_back(metric);
    }
    for (const Metric metric : shown) html += "<th>" + Label(metric) + "</th>";
    html += "</tr>\n";
    for (size_t i = 0; i < std::min(tracked.size(), kMostBest); ++i) {
      const TrialRow& row = *tracked[i];
      html += fmt::format("<tr><td><a href=\"{}\">{}</a></td>", LinkTo(row), row.trial.number);
      for (const double value : row.trial.parameters) html += fmt::format("<td>{:.6g}</td>", value);
      for (const Metric metric : shown) html += fmt::format("<td>{:.4g}</td>", row.result.metrics[metric]);
      html += "</tr>\n";
    }
    return html + "</table>\n";
  }

  [[nodiscard]] std::string Commands() const {
    std::string html = "<h2>Commands</h2>\n<p>Each repeats one trial, with its log and video.</p>\n";
    for (const TrialRow& row : rows_) {
      html += fmt::format("<pre id=\"trial-{}\" title=\"{}\">{}</pre>\n", row.trial.number,
                          EscapeHtml(Describe(row)), EscapeHtml(MakeReplayCommand(study_, row.trial)));
    }
    return html;
  }

  const StudyStore* store_;
  Study study_;
  std::vector<TrialRow> rows_;
  StudyInputs inputs_;
  std::vector<Metric> metrics_;
};

}  // namespace

std::string MakeReplayCommand(const Study& study, const Trial& trial) {
  std::string command = "dexcheck run " + QuoteForShell(study.scenario);
  for (const std::string& setting : ListOverrides(study, trial))
    command += " --set " + QuoteForShell(setting);
  if (trial.seed != 0) command += fmt::format(" --seed {}", trial.seed);
  if (!study.check) command += " --no-check";
  return command +
         fmt::format(" --out trial-{0}; dexcheck render trial-{0} --out trial-{0}.mp4", trial.number);
}

std::string MakeStudyReport(const StudyStore& store) { return Report(store).Make(); }

}  // namespace dexcheck
