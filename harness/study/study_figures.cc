#include "harness/study/study_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "harness/report/figure.h"
#include "harness/study/study_charts.h"
#include "harness/study/study_theory.h"

namespace dexcheck {
namespace {

constexpr std::array<const char*, kNumOutcomes> kOutcomeColors = {
    "#7bb662", "#f2c14e", "#e4572e", "#f78154", "#9b2226", "#577590", "#cccccc", "#000000", "#6d597a"};
constexpr const char* kStabilityColor = "#0b3c8c";
constexpr const char* kDampingColor = "#ffffff";
constexpr size_t kMostLines = 6;
constexpr size_t kMostListed = 2000;       // trials that a page has one by one
constexpr size_t kMostOfALine = 500;       // points
constexpr double kMostLinkedCells = 2500;  // of a map; one with more is an image

using IsWorse = std::function<bool(const TrialRow&, const TrialRow&)>;

Axis AxisOf(const Variation& variation) {
  Axis axis{variation.key, variation.values, false, variation.labels};
  std::sort(axis.values.begin(), axis.values.end());
  const double first = axis.values.front();
  axis.logarithmic = variation.labels.empty() && first > 0.0 && axis.values.back() / first > 10.0;
  return axis;
}

bool IsGrid(const Study& study) {
  return study.sample.method == SamplingMethod::kGrid && !study.is_search() && study.num_keys() >= 2;
}

/// A map over the first two keys of a grid.
class Grid {
 public:
  explicit Grid(const StudyResults& results)
      : results_(results), x_(AxisOf(results.study.variations[0])), y_(AxisOf(results.study.variations[1])) {}

  [[nodiscard]] Html DrawOutcomes() const {
    const auto cells = WorstOfCells([](const TrialRow& a, const TrialRow& b) {
      return IsHeld(a.result.outcome) < IsHeld(b.result.outcome) ||
             (IsHeld(a.result.outcome) == IsHeld(b.result.outcome) && a.result.outcome > b.result.outcome);
    });
    HeatMap map = MakeMap("outcome");
    map.with_boundary = true;
    for (const TrialRow* row : cells) {
      if (row == nullptr) {
        map.cells.emplace_back();
        continue;
      }
      const Outcome outcome = row->result.outcome;
      map.cells.push_back({FindColor(outcome), map.as_image ? "" : Describe(results_.study, *row),
                           map.as_image ? "" : LinkTo(*row), IsHeld(outcome)});
    }
    map.overlays = {FindBoundary(kStabilityColor, IsStableInTheory),
                    FindBoundary(kDampingColor, IsDampedInTheory)};
    return DrawHeatMap(map);
  }

  [[nodiscard]] Html DrawMetric(Metric metric) const {
    const double sign = metric == kConeMargin ? -1.0 : 1.0;  // a small margin is the worse
    const auto cells = WorstOfCells([&](const TrialRow& a, const TrialRow& b) {
      return !(sign * a.result.metrics[metric] <= sign * b.result.metrics[metric]);
    });
    const auto find_value = [&](const TrialRow* row) {
      return row != nullptr && IsHeld(row->result.outcome) ? row->result.metrics[metric] : std::nan("");
    };
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (const TrialRow* row : cells) {
      const double value = find_value(row);
      if (!std::isfinite(value)) continue;
      least = std::min(least, value);
      most = std::max(most, value);
    }
    HeatMap map = MakeMap(LabelOf(metric));
    if (least <= most) map.range = {least, most};
    for (const TrialRow* row : cells) {
      const double value = find_value(row);
      map.cells.push_back(row == nullptr ? HeatCell{}
                          : map.as_image
                              ? HeatCell{ColorOf(value, least, most), "", "", !(value > kVisibleOvershoot)}
                              : HeatCell{ColorOf(value, least, most),
                                         fmt::format("{:.4g}; {}", value, Describe(results_.study, *row)),
                                         LinkTo(*row), !(value > kVisibleOvershoot)});
    }
    if (metric == kOvershoot && least <= most) {
      map.with_boundary = true;
      map.overlays = {
          FindBoundary(kDampingColor, [](const StudyInputs& inputs, const std::vector<double>& at) {
            return CalcOvershootInTheory(inputs, at) <= kVisibleOvershoot;
          })};
    }
    return DrawHeatMap(map);
  }

 private:
  [[nodiscard]] HeatMap MakeMap(const std::string& title) const {
    HeatMap map{title, x_, y_, {}, false, {}, {}};
    map.as_image =
        static_cast<double>(x_.values.size()) * static_cast<double>(y_.values.size()) > kMostLinkedCells;
    return map;
  }

  [[nodiscard]] Dots FindBoundary(const char* color, const TheoryTest& test) const {
    return {color, FindTurns(results_.inputs, results_.rows.front().trial.parameters, test)};
  }

  [[nodiscard]] std::vector<const TrialRow*> WorstOfCells(const IsWorse& is_worse) const {
    std::vector<const TrialRow*> cells(x_.values.size() * y_.values.size(), nullptr);
    const auto find = [](const Axis& axis, double value) {
      return static_cast<size_t>(std::lower_bound(axis.values.begin(), axis.values.end(), value) -
                                 axis.values.begin());
    };
    for (const TrialRow& row : results_.rows) {
      const size_t column = find(x_, row.trial.parameters[0]);
      const size_t line = find(y_, row.trial.parameters[1]);
      if (column == x_.values.size() || line == y_.values.size()) continue;  // not of this grid
      const size_t cell = line * x_.values.size() + column;
      if (cells[cell] == nullptr || is_worse(row, *cells[cell])) cells[cell] = &row;
    }
    return cells;
  }

  const StudyResults& results_;
  Axis x_, y_;
};

Chart MakeChart(const std::string& title, const std::string& x, const std::string& y) {
  return {title, {x, {}, false}, {y, {}, false}, {}, {}};
}

/// A few values of the second key, the ends among them; one that means nothing when there is no second key.
std::vector<double> ChooseLines(const Study& study) {
  if (study.num_keys() < 2) return {0.0};
  const std::vector<double>& all = study.variations[1].values;
  const size_t count = std::min(all.size(), kMostLines);
  std::vector<double> chosen;
  for (size_t i = 0; i < count; ++i)
    chosen.push_back(all[count > 1 ? i * (all.size() - 1) / (count - 1) : 0]);
  return chosen;
}

/// Every so many points of a long line, and its end.
template <typename Point>
void Thin(std::vector<Point>* points) {
  const size_t every = (points->size() + kMostOfALine - 1) / kMostOfALine;
  if (every <= 1) return;
  std::vector<Point> fewer;
  for (size_t i = 0; i < points->size(); i += every) fewer.push_back((*points)[i]);
  if ((points->size() - 1) % every != 0) fewer.push_back(points->back());
  *points = std::move(fewer);
}

/// The median of each group of points with one x: of the trials of one point. @param points sorted.
std::vector<std::pair<double, double>> FindMedians(const std::vector<std::pair<double, double>>& points) {
  std::vector<std::pair<double, double>> medians;
  for (auto from = points.begin(); from != points.end();) {
    const auto to =
        std::find_if(from, points.end(), [&](const auto& point) { return point.first != from->first; });
    const auto count = to - from;
    medians.emplace_back(from->first, 0.5 * (from[(count - 1) / 2].second + from[count / 2].second));
    from = to;
  }
  return medians;
}

/// A bar from the least to the largest of each group of points with one x, and a dash at its median.
void AddSpreads(const std::vector<std::pair<double, double>>& points, const std::string& color,
                std::vector<ChartLine>* lines) {
  constexpr double kHalfDash = 0.12;  // of the distance between two texts
  for (const auto& [x, median] : FindMedians(points)) {
    const auto is_of_x = [x = x](const auto& point) { return point.first == x; };
    const auto from = std::find_if(points.begin(), points.end(), is_of_x);
    const auto last = std::find_if(points.rbegin(), points.rend(), is_of_x);
    if (&*from == &*last) continue;
    lines->push_back({"", color, {*from, *last}});
    lines->push_back({"", color, {{x - kHalfDash, median}, {x + kHalfDash, median}}});
  }
}

/// From the least error on, those that need less work than all before; of many an even part.
std::vector<const TrialRow*> ListFront(const std::vector<const TrialRow*>& tracked) {
  std::vector<const TrialRow*> front;
  for (const TrialRow* row : tracked) {
    if (front.empty() || row->result.metrics[kEnergy] < front.back()->result.metrics[kEnergy]) {
      front.push_back(row);
    }
  }
  Thin(&front);
  return front;
}

}  // namespace

StudyResults::StudyResults(const StudyStore& store)
    : study(store.study()), rows(store.ReadRows(0, /*with_machine=*/false)), error(FindErrorMetric(rows)) {
  inputs.study = study;
  inputs.scenario_text = store.Identify("scenario");
  inputs.scenario_source = study.scenario;
  for (const std::string& name : study.metrics) {
    for (size_t i = 0; i < kMetrics.size(); ++i) {
      if (kMetrics[i].name == name) metrics.push_back(static_cast<Metric>(i));
    }
  }
  if (metrics.empty()) metrics = {error, kPeakEffort, of_joints() ? kEnergy : kConeMargin};
  const size_t every = (rows.size() + kMostListed - 1) / kMostListed;
  for (size_t i = 0; i < rows.size(); i += std::max(every, size_t{1})) listed.push_back(&rows[i]);
  if (every <= 1) return;
  const std::vector<const TrialRow*> tracked = ListTracked();
  listed.insert(listed.end(), tracked.begin(),
                tracked.begin() + static_cast<std::ptrdiff_t>(std::min(tracked.size(), kMostBest)));
  const std::vector<const TrialRow*> front = ListFront(tracked);
  listed.insert(listed.end(), front.begin(), front.end());
  std::sort(listed.begin(), listed.end(),
            [](const TrialRow* a, const TrialRow* b) { return a->trial.number < b->trial.number; });
  listed.erase(std::unique(listed.begin(), listed.end()), listed.end());
}

std::vector<const TrialRow*> StudyResults::ListTracked() const {
  std::vector<const TrialRow*> tracked;
  for (const TrialRow& row : rows) {
    if (row.result.outcome == Outcome::kTracked) tracked.push_back(&row);
  }
  std::stable_sort(tracked.begin(), tracked.end(), [this](const TrialRow* a, const TrialRow* b) {
    return a->result.metrics[error] < b->result.metrics[error];
  });
  return tracked;
}

std::string FindColor(Outcome outcome) { return kOutcomeColors[static_cast<size_t>(outcome)]; }

std::string LabelOf(Metric metric) {
  const std::string unit = kMetrics[metric].unit;
  return kMetrics[metric].name + (unit == "1" ? "" : ", " + unit);
}

std::string LinkTo(const TrialRow& row) { return fmt::format("#trial-{}", row.trial.number); }

std::string Describe(const Study& study, const TrialRow& row) {
  std::string text = fmt::format("trial {}: ", row.trial.number);
  for (size_t i = 0; i < study.variations.size(); ++i) {
    const Variation& variation = study.variations[i];
    const double value = row.trial.parameters[i];
    text +=
        fmt::format("{} = {}, ", variation.key,
                    variation.labels.empty() ? fmt::format("{:.6g}", value) : FormatValue(variation, value));
  }
  text += NameOf(row.result.outcome);
  if (!row.result.failure.empty()) text += ": " + row.result.failure;
  return text;
}

Html DrawOutcomes(const StudyResults& results) {
  const Study& study = results.study;
  if (study.num_keys() < 2) return {};
  if (IsGrid(study)) return Grid(results).DrawOutcomes();
  // Samples: where they lie.
  Chart chart = MakeChart("outcome", study.variations[0].key, study.variations[1].key);
  for (const TrialRow* row : results.listed) {
    chart.points.push_back({row->trial.parameters[0], row->trial.parameters[1],
                            FindColor(row->result.outcome), Describe(study, *row), LinkTo(*row)});
  }
  return DrawChart(chart);
}

Html DrawMetrics(const StudyResults& results) {
  if (!IsGrid(results.study)) return {};
  Html figures;
  for (const Metric metric : results.metrics) figures += Grid(results).DrawMetric(metric);
  return figures;
}

Html DrawLines(const StudyResults& results) {
  const Study& study = results.study;
  if ((study.sample.method != SamplingMethod::kGrid || study.is_search())) return {};
  const bool has_second = study.num_keys() > 1;
  const std::vector<double> chosen = ChooseLines(study);
  Html figures;
  for (const Metric metric : results.metrics) {
    Chart chart = MakeChart(LabelOf(metric), study.variations[0].key, LabelOf(metric));
    chart.x.labels = study.variations[0].labels;
    for (size_t i = 0; i < chosen.size(); ++i) {
      ChartLine line;
      line.color = FindColor(static_cast<int>(i));
      if (has_second) {
        const Variation& second = study.variations[1];
        const bool is_number = second.labels.empty();
        line.label =
            fmt::format("{} = {}", second.key,
                        is_number ? fmt::format("{:.3g}", chosen[i]) : FormatValue(second, chosen[i]));
      }
      for (const TrialRow& row : results.rows) {
        const bool mine = (!has_second || row.trial.parameters[1] == chosen[i]) &&
                          IsHeld(row.result.outcome) && std::isfinite(row.result.metrics[metric]);
        if (!mine) continue;
        line.points.emplace_back(row.trial.parameters[0], row.result.metrics[metric]);
        if (chart.x.labels.empty()) continue;
        chart.points.push_back({row.trial.parameters[0], row.result.metrics[metric], line.color,
                                Describe(study, row), LinkTo(row)});
      }
      std::sort(line.points.begin(), line.points.end());
      if (line.points.empty()) continue;
      // Between texts there is no line.
      if (!chart.x.labels.empty()) {
        if (!has_second) AddSpreads(line.points, line.color, &chart.lines);
        line.points.clear();
      } else {
        line.points = FindMedians(line.points);
        Thin(&line.points);
      }
      chart.lines.push_back(line);
    }
    if (!chart.lines.empty()) figures += DrawChart(chart);
  }
  return figures;
}

Html DrawErrorAgainstEffort(const StudyResults& results) {
  const std::vector<const TrialRow*> tracked = results.ListTracked();
  if (tracked.empty()) return {};
  const Metric error = results.error;
  Chart chart = MakeChart("error against effort", LabelOf(kEnergy), LabelOf(error));
  ChartLine line{"Pareto front", "#9b2226", {}};
  for (const TrialRow* row : ListFront(tracked)) {
    line.points.emplace_back(row->result.metrics[kEnergy], row->result.metrics[error]);
  }
  for (const TrialRow* row : results.listed) {
    if (row->result.outcome != Outcome::kTracked) continue;
    chart.points.push_back({row->result.metrics[kEnergy], row->result.metrics[error],
                            FindColor(Outcome::kTracked), Describe(results.study, *row), LinkTo(*row)});
  }
  chart.lines.push_back(line);
  return DrawChart(chart);
}

}  // namespace dexcheck
