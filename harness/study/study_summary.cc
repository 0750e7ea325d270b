
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "controller/common/text.h"
#include "harness/plant/random_stream.h"
#include "harness/study/sampling.h"
#include "harness/study/search.h"
#include "harness/study/study_findings.h"

namespace dexcheck {

namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMostBest = 20;  // trials in the table of the best

std::string LabelOf(Metric metric) {
  const std::string unit = kMetrics[metric].unit;
  return kMetrics[metric].name + (unit == "1" ? "" : ", " + unit);
}

class Summary {
 public:
  explicit Summary(const StudyStore& store)
      : study_(store.study()),
        rows_(store.ReadRows(0, /*with_machine=*/false)),
        error_(FindErrorMetric(rows_)) {
    inputs_.study = study_;
    inputs_.scenario_text = store.Identify("scenario");
    inputs_.scenario_source = study_.scenario;
    for (const std::string& name : study_.metrics) metrics_.push_back(FindMetric(name).value());
    if (metrics_.empty()) metrics_ = {error_, kPeakEffort, of_joints() ? kEnergy : kConeMargin};
    for (const TrialRow& row : rows_) {
      if (row.result.outcome == Outcome::kTracked) tracked_.push_back(&row);
    }
    for (int i = 0; i < kNumMetrics; ++i) {
      const auto metric = static_cast<Metric>(i);
      if (IsNeeded(metric)) columns_.push_back(metric);
    }
    std::ranges::stable_sort(tracked_, [&](const TrialRow* a, const TrialRow* b) {
      return a->result.metrics[error_] < b->result.metrics[error_];
    });
  }

  Json MakeJson() {
    Json json = {{"name", study_.name},
                 {"description", study_.description},
                 {"scenario", study_.scenario},
                 {"overrides", study_.overrides},
                 {"check", study_.check},
                 {"seeds", study_.seeds.size()},
                 {"is_search", study_.is_search()},
                 {"is_grid", study_.sample.method == SamplingMethod::kGrid && !study_.is_search()},
                 {"done", rows_.size()},
                 {"total", CountTrials(study_)},
                 {"error", kMetrics[error_].name}};
    json["outcomes"] = ListOutcomes();
    json["findings"] = ListFindings(study_, rows_);
    json["gain_card"] = MakeGainCard(inputs_, rows_);
    json["best"] = rows_.empty() ? Json(nullptr) : ListBest();
    json["sensitivity"] = ListSensitivity();
    ChooseShown();
    json["keys"] = Json::array();
    for (const Variation& variation : study_.variations) json["keys"].push_back(variation.key);
    json["shown"] = Json::array();
    for (const Metric metric : metrics_) json["shown"].push_back(kMetrics[metric].name);
    json["columns"] = ListColumns();
    json["added"] = Json::array();
    for (const TrialRow* row : added_) json["added"].push_back(row->trial.number);
    json["failures"] = ListFailures();
    json["history"] = ListHistory();
    json["maximize"] = !study_.objectives.empty() && study_.objectives.front().maximize;
    return json;
  }

  /// The numbers of the trials that MakeJson chose to be shown.
  [[nodiscard]] std::string PackValues() const {
    std::string bytes;
    const auto add = [&](double value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
    for (const TrialRow* row : shown_) {
      add(static_cast<double>(row->trial.number));
      add(static_cast<double>(row->trial.seed));
      add(static_cast<double>(row->result.outcome));
      for (const double parameter : row->trial.parameters) add(parameter);
      for (const Metric metric : columns_) add(row->result.metrics[metric]);
    }
    return bytes;
  }

 private:
  [[nodiscard]] bool of_joints() const { return error_ == kJointErrorRms; }

  /// Whether the page has a column for a metric: it shows the metric, or a trial has a value of it.
  [[nodiscard]] bool IsNeeded(Metric metric) const {
    return metric == error_ || metric == kEnergy || std::ranges::find(metrics_, metric) != metrics_.end() ||
           std::ranges::any_of(
               rows_, [&](const TrialRow& row) { return std::isfinite(row.result.metrics[metric]); });
  }

  [[nodiscard]] Json ListOutcomes() const {
    std::array<long, kOutcomes.size()> counts{};
    for (const TrialRow& row : rows_) ++counts[static_cast<size_t>(row.result.outcome)];
    Json outcomes = Json::array();
    for (size_t i = 0; i < kOutcomes.size(); ++i) {
      const auto& [name, is_held, color] = kOutcomes[i];
      outcomes.push_back({{"name", name}, {"count", counts[i]}, {"held", is_held}, {"color", color}});
    }
    return outcomes;
  }

  const TrialRow& FindRow(long number) const {
    return *std::ranges::lower_bound(rows_, number, {}, [](const TrialRow& row) { return row.trial.number; });
  }

  Json ListBest() {
    Json best = {{"order", ""}, {"heads", Json::array()}, {"rows", Json::array()}};
    for (const Variation& variation : study_.variations) best["heads"].push_back(variation.key);
    if (study_.objectives.empty()) {
      FillByError(&best);
    } else {
      FillByObjectives(&best);
    }
    return best;
  }

  void AddBest(const TrialRow& row, const std::vector<double>& keys, const std::vector<double>& more,
               Json* best) {
    Json cells = Json::array();
    for (size_t i = 0; i < keys.size(); ++i) cells.push_back(ShowValue(study_.variations[i], keys[i]));
    for (const double value : more) cells.push_back(value);
    (*best)["rows"].push_back({{"trial", row.trial.number}, {"cells", cells}});
    best_.push_back(&row);
  }

  /// Fills in for a study that says what it wants the points that fulfil the constraints, by the objective;
  /// of several objectives those that no other point beats in all.
  void FillByObjectives(Json* best) {
    const std::vector<JudgedPoint> points = JudgePoints(study_, rows_);
    const bool is_one = study_.objectives.size() == 1;
    const std::vector<const JudgedPoint*> chosen = is_one ? SortFeasible(points) : FindFront(points);
    if (points.empty()) return;
    if (chosen.empty()) {
      (*best)["order"] = fmt::format("At none of {} points all constraints hold.", points.size());
      return;
    }
    const Objective& first = study_.objectives.front();
    const std::string order =
        is_one ? fmt::format("By the {} {}", first.maximize ? "largest" : "least", Describe(first))
               : "Points that no other one beats in everything";
    (*best)["order"] = fmt::format(
        "{}, of {} points{}{}", order, points.size(),
        study_.constraints.empty() ? "." : ", those at which all constraints hold.",
        CountTrialsOfPoint(study_) > 1 ? " A point's trials begin with the one that is named." : "");
    for (const Objective& objective : study_.objectives)
      (*best)["heads"].push_back(Describe(objective) + ShowUnit(objective.expression));
    for (size_t i = 0; i < std::min(chosen.size(), kMostBest); ++i) {
      std::vector<double> values;
      for (size_t k = 0; k < study_.objectives.size(); ++k)
        values.push_back(ShowObjective(study_, *chosen[i], k));
      AddBest(FindRow(chosen[i]->number * CountTrialsOfPoint(study_)), chosen[i]->values, values, best);
    }
  }

  /// Fills in for any other study the trials by their error.
  void FillByError(Json* best) {
    if (tracked_.empty()) return;
    std::vector<const TrialRow*> admitted = tracked_;
    std::erase_if(admitted, [&](const TrialRow* row) {
      return !JudgePoint({}, study_.constraints, {&row->result, 1}).is_feasible();
    });
    if (admitted.empty()) {
      (*best)["order"] =
          fmt::format("In none of the {} trials that tracked all constraints hold.", tracked_.size());
      return;
    }
    (*best)["order"] =
        fmt::format("By rms {} error, of the trials that tracked{}.", of_joints() ? "joint" : "position",
                    study_.constraints.empty() ? "" : " and fulfil the constraints");
    std::vector<Metric> metrics = {error_, kEnergy};
    for (const Metric metric : metrics_) {
      if (std::ranges::find(metrics, metric) == metrics.end()) metrics.push_back(metric);
    }
    for (const Metric metric : metrics) (*best)["heads"].push_back(LabelOf(metric));
    for (size_t i = 0; i < std::min(admitted.size(), kMostBest); ++i) {
      std::vector<double> values;
      values.reserve(metrics.size());
      for (const Metric metric : metrics) values.push_back(admitted[i]->result.metrics[metric]);
      AddBest(*admitted[i], admitted[i]->trial.parameters, values, best);
    }
  }

  [[nodiscard]] Json ListSensitivity() const {
    Json list = Json::array();
    if (study_.sample.method != SamplingMethod::kMorris) return list;
    for (const std::string& quantity : ListQuantities(study_, rows_)) {
      const Sensitivity sensitivity = AnalyseSensitivity(study_, rows_, quantity);
      if (sensitivity.effects.empty()) continue;
      Json keys = Json::array();
      for (const size_t key : sensitivity.ListByImportance()) {
        const MorrisEffect& effect = sensitivity.effects[key];
        keys.push_back({{"key", study_.variations[key].key},
                        {"value", effect.size.value},
                        {"low", effect.size.low},
                        {"high", effect.size.high},
                        {"spread", effect.spread}});
      }
      const std::string unit = ShowUnit(quantity);
      list.push_back({{"quantity", unit.empty() ? quantity : fmt::format("{},{}", quantity, unit)},
                      {"method", "morris"},
                      {"left_out", sensitivity.left_out},
                      {"keys", keys}});
    }
    return list;
  }

  /// All rows, or of more than kMostShown those of points that are drawn by a hash of their number: the
  /// trials of all seeds of a point, or none. A step through the rows would meet the same values of a grid's
  /// keys again and again.
  [[nodiscard]] std::vector<const TrialRow*> DrawPoints() const {
    const long trials = CountTrialsOfPoint(study_);
    // The trials of a point stay together, unless one point alone has too many.
    const long together = static_cast<size_t>(trials) > kMostShown ? 1 : trials;
    const RandomStream stream(/*seed=*/0, "page");
    std::vector<std::pair<double, const TrialRow*>> drawn;
    drawn.reserve(rows_.size());
    for (const TrialRow& row : rows_)
      drawn.emplace_back(stream.Uniform(static_cast<std::uint64_t>(row.trial.number / together)), &row);
    if (drawn.size() > kMostShown) {
      std::ranges::sort(drawn);
      size_t end = kMostShown;
      while (end > 0 && drawn[end].first == drawn[end - 1].first) --end;
      drawn.resize(end);
    }
    std::vector<const TrialRow*> rows;
    rows.reserve(drawn.size());
    for (const auto& [place, row] : drawn) rows.push_back(row);
    std::ranges::sort(rows);  // by number, as those of one vector
    return rows;
  }

  /// All trials, or a drawn part; apart from these the best, to which the table leads.
  void ChooseShown() {
    shown_ = DrawPoints();
    std::ranges::sort(best_);
    std::ranges::set_difference(best_, shown_, std::back_inserter(added_));
    shown_.insert(shown_.end(), added_.begin(), added_.end());
    std::ranges::sort(shown_);
  }

  /// Names and labels of what PackValues has of each trial.
  [[nodiscard]] Json ListColumns() const {
    Json columns = {{{"name", "trial"}, {"label", "trial"}},
                    {{"name", "seed"}, {"label", "seed"}},
                    {{"name", "outcome"}, {"label", "outcome"}}};
    for (const Variation& variation : study_.variations) {
      Json column = {{"name", variation.key}, {"label", variation.key}};
      if (!variation.labels.empty()) column["labels"] = variation.labels;
      columns.push_back(column);
    }
    for (const Metric metric : columns_) {
      columns.push_back({{"name", kMetrics[metric].name}, {"label", LabelOf(metric)}});
      if (kMetrics[metric].is_better_large) columns.back()["larger_is_better"] = true;
    }
    return columns;
  }

  /// By the trial's number.
  [[nodiscard]] Json ListFailures() const {
    Json failures = Json::object();
    for (const TrialRow* row : shown_) {
      if (!row->result.failure.empty())
        failures[std::to_string(row->trial.number)] = Abbreviate(row->result.failure);
    }
    return failures;
  }

  /// The points of a search.
  [[nodiscard]] Json ListHistory() const {
    Json history = Json::array();
    if (!study_.is_search()) return history;
    for (const JudgedPoint& point : JudgePoints(study_, rows_)) {
      history.push_back({{"trial", point.number * CountTrialsOfPoint(study_)},
                         {"value", ShowObjective(study_, point)},
                         {"feasible", point.judgement.is_feasible()}});
    }
    return history;
  }

  Study study_;
  StudyInputs inputs_;  // as far as the database keeps them: for scenarios of trials
  std::vector<TrialRow> rows_;
  Metric error_;                          // that says how good the trials are
  std::vector<Metric> metrics_;           // to be shown
  std::vector<Metric> columns_;           // that the page has of each trial
  std::vector<const TrialRow*> tracked_;  // least error first
  std::vector<const TrialRow*> shown_;    // by number
  std::vector<const TrialRow*> best_;     // in the table of the best
  std::vector<const TrialRow*> added_;    // of the best, those that were not drawn
};

}  // namespace

StudySummary SummariseStudy(const StudyStore& store) {
  Summary summary(store);
  Json json = summary.MakeJson();
  for (const char* column : {"dexcheck_version", "git_revision", "mujoco_version"})
    json["versions"][column] = store.Identify(column);
  return {std::move(json), summary.PackValues()};
}

}  // namespace dexcheck
