#include "harness/study/study_explorer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "controller/common/errors.h"
#include "harness/study/explorer_assets.h"
#include "harness/study/search_history.h"
#include "harness/study/study_answer.h"
#include "harness/study/study_theory.h"

namespace dexcheck {
namespace {

using Json = nlohmann::ordered_json;

/// Rows that the page has: all, or every so many.
std::vector<const TrialRow*> ChooseRows(const StudyResults& results) {
  std::vector<const TrialRow*> chosen;
  const size_t every = (results.rows.size() + kMostExplored - 1) / kMostExplored;
  for (size_t i = 0; i < results.rows.size(); i += std::max(every, size_t{1}))
    chosen.push_back(&results.rows[i]);
  if (every <= 1) return chosen;
  chosen.insert(chosen.end(), results.listed.begin(), results.listed.end());
  std::sort(chosen.begin(), chosen.end(),
            [](const TrialRow* a, const TrialRow* b) { return a->trial.number < b->trial.number; });
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

Json ListColumns(const Study& study) {
  Json columns = {{{"name", "trial"}, {"label", "trial"}},
                  {{"name", "seed"}, {"label", "seed"}},
                  {{"name", "outcome"}, {"label", "outcome"}}};
  for (const Variation& variation : study.variations) {
    Json column = {{"name", variation.key}, {"label", variation.key}};
    if (!variation.labels.empty()) column["labels"] = variation.labels;
    columns.push_back(column);
  }
  for (int i = 0; i < kNumMetrics; ++i) {
    const auto metric = static_cast<Metric>(i);
    columns.push_back({{"name", kMetrics[metric].name}, {"label", LabelOf(metric)}});
    if (metric == kConeMargin || metric == kSimulatedTime) columns.back()["larger"] = true;
  }
  return columns;
}

/// Whether (57) knows the metrics of this trial.
bool IsPredicted(const StudyResults& results, const TrialRow& row) {
  try {
    return std::isfinite(PredictInTheory(results.inputs, row.trial.parameters).metrics[kPositionErrorRms]);
  } catch (const InputError&) {
    return false;
  }
}

/// The points of a search; with their first objective in theory where (57) knows it.
Json ListHistory(const StudyResults& results, bool is_predicted) {
  constexpr size_t kMostAsked = 2000;  // trials that theory is asked about
  const Objective& objective = results.study.objectives.front();
  const std::vector<JudgedPoint> points = JudgePoints(results.study, results.rows);
  const bool asks = is_predicted && points.size() * ListDraws(results.study).size() <= kMostAsked;
  Json history = Json::array();
  for (const JudgedPoint& point : points) {
    Json entry = {{"value", ShowObjective(objective, point.judgement.objectives.front())},
                  {"feasible", point.judgement.is_feasible()}};
    if (asks) {
      const Judgement theory = JudgeInTheory(results.inputs, point.values);
      if (theory.is_feasible()) entry["theory"] = ShowObjective(objective, theory.objectives.front());
    }
    history.push_back(std::move(entry));
  }
  return history;
}

/// Metrics that (57) predicts: at points all over the ranges, and along each key that it knows.
Json ListPredictions(const StudyResults& results, const std::vector<bool>& knows, std::vector<double> at) {
  constexpr long kPoints = 256;
  constexpr int kAlong = 32;
  constexpr size_t kMostKeys = 12;
  const Study& study = results.study;
  const auto predict = [&](const std::vector<double>& parameters) {
    Json values = Json::array();
    try {
      const TrialResult result = PredictInTheory(results.inputs, parameters);
      for (const Metric metric : kPredictedMetrics) values.push_back(result.metrics[metric]);
    } catch (const InputError&) {  // values that make no scenario
      values = Json(kPredictedMetrics.size(), nullptr);
    }
    return values;
  };
  Json sampled = Json::array();
  const std::vector<double> draw = ListDraws(study).front();
  const int keys = static_cast<int>(study.num_keys());
  if (keys <= kMaxSobolDimensions) {
    for (const UnitPoint& point : MakeSobol(keys, kPoints)) {
      std::vector<double> parameters = ValuesAt(study.keys(), point);
      parameters.insert(parameters.end(), draw.begin(), draw.end());
      sampled.push_back(predict(parameters));
    }
  }
  Json along = Json::array();
  for (size_t key = 0; key < knows.size() && along.size() < kMostKeys; ++key) {
    if (!knows[key]) continue;
    const double own = at[key];
    Json values = Json::array();
    Json metrics = Json::array();
    for (int i = 0; i <= kAlong; ++i) {
      at[key] = ValueAt(study.variations[key], static_cast<double>(i) / kAlong);
      values.push_back(at[key]);
      metrics.push_back(predict(at));
    }
    at[key] = own;
    along.push_back({{"key", key}, {"values", values}, {"metrics", metrics}});
  }
  Json names = Json::array();
  for (const Metric metric : kPredictedMetrics) names.push_back(kMetrics[metric].name);
  return {{"metrics", names}, {"sampled", sampled}, {"along", along}};
}

/// What (57) says, and what it says beside the point that the study is about: the best one, else the first.
Json ListTheory(const StudyResults& results) {
  const TrialRow* at = &results.rows.front();
  std::string place = "the first trial";
  if (!results.study.objectives.empty()) {
    if (const auto best = SummarisePoints(results.study, results.rows).best) {
      const long number = best->number * CountTrialsOfPoint(results.study);
      const auto row =
          std::lower_bound(results.rows.begin(), results.rows.end(), number,
                           [](const TrialRow& a, long wanted) { return a.trial.number < wanted; });
      if (row != results.rows.end()) at = &*row;
      place = "trial " + std::to_string(number) + ", the best";
    }
  }
  const KeyTheory theory = FindKeyTheory(results.inputs, at->trial.parameters);
  Json turns = Json::array();
  for (const KeyTheory::Turn& turn : theory.turns)
    turns.push_back({{"key", turn.key}, {"stability", turn.is_stability}, {"value", turn.value}});
  Json curves = Json::array();
  for (const KeyTheory::Curve& curve : theory.curves)
    curves.push_back(
        {{"x", curve.x}, {"y", curve.y}, {"stability", curve.is_stability}, {"points", curve.points}});
  Json list = {{"knows", theory.knows}, {"turns", turns}, {"curves", curves}, {"place", place}};
  if (IsPredicted(results, *at)) {
    list["predicted"] = ListPredictions(results, theory.knows, at->trial.parameters);
    if (results.study.is_search()) {
      if (const auto least = FindLeastInTheory(results.inputs))
        list["least"] = ShowObjective(results.study.objectives.front(), *least);
    }
  }
  return list;
}

}  // namespace

Html MakeExplorer(const StudyResults& results) {
  const bool has_history = results.study.is_search() && !results.study.objectives.empty();
  Html html(
      "<section id=\"explore\"><h2>Look closer</h2>\n<div class=\"tools\"><label>of <select "
      "id=\"explore-outcome\">"
      "</select></label><label>where <input id=\"explore-filter\" placeholder=\"energy &lt; 3, control.K_p "
      "&gt; 10\">"
      "</label><span id=\"explore-count\" class=\"soft\"></span></div>\n<div class=\"grid\">\n");
  if (has_history) {
    html +=
        "<section class=\"card\"><h3>The best so far</h3><canvas id=\"explore-history\" "
        "class=\"wide\"></canvas>"
        "<p class=\"soft\">Each point of the search, and the best until then; strokes at the top do not "
        "fulfil the "
        "constraints.<span id=\"explore-theory-best\"></span></p></section>\n";
  }
  html +=
      "<section class=\"card\"><h3>Any two</h3><div class=\"tools\"><label>along <select "
      "id=\"explore-x\"></select>"
      "</label><label>up <select id=\"explore-y\"></select></label><label>colour <select "
      "id=\"explore-color\"></select>"
      "</label></div><canvas id=\"explore-scatter\"></canvas><p class=\"soft\" "
      "id=\"explore-front\"></p><p class=\"soft\" id=\"explore-theory\"></p></section>\n";
  if (results.study.variations.size() > 1) {
    html +=
        "<section class=\"card\"><h3>Over two keys</h3><div class=\"tools\"><label>along <select "
        "id=\"explore-cx\">"
        "</select></label><label>up <select id=\"explore-cy\"></select></label><label>mean of <select "
        "id=\"explore-cz\">"
        "</select></label></div><canvas id=\"explore-contour\"></canvas><p class=\"soft\" "
        "id=\"explore-range\"></p><p class=\"soft\" id=\"explore-theory-over\"></p>"
        "</section>\n";
  }
  html +=
      "<section class=\"card\"><h3>All keys</h3><canvas id=\"explore-parallel\" class=\"wide\"></canvas><p "
      "class=\"soft\">Drag along an axis to keep a part of it, click on it to keep all.<span "
      "id=\"explore-theory-beside\"></span></p></section>\n"
      "<section class=\"card\"><h3>Which key goes with <span "
      "id=\"explore-importance-of\"></span></h3><table><tbody "
      "id=\"explore-importance\"></tbody></table><p class=\"soft\">Correlation of ranks over the trials that "
      "were "
      "held. The error dynamics have the keys that are marked with (57).</p></section>\n</div>\n"
      "<section class=\"card\" id=\"explore-chosen\" hidden><h3 id=\"explore-which\"></h3><p class=\"soft\" "
      "id=\"explore-numbers\"></p><p>Its run, with its video:</p><pre id=\"explore-command\"></pre><p>What "
      "its errors are "
      "made of:</p><pre id=\"explore-budget\"></pre></section>\n"
      "<div class=\"card scroll\"><table><thead><tr id=\"explore-head\"></tr></thead><tbody "
      "id=\"explore-body\"></tbody>"
      "</table></div>\n</section>\n";
  return html;
}

Html MakeExplorerScript(const StudyResults& results) {
  const Study& study = results.study;
  const std::vector<const TrialRow*> rows = ChooseRows(results);
  Json data = {{"scenario", study.scenario},   {"overrides", study.overrides},
               {"check", study.check},         {"seeds", study.seeds.size()},
               {"total", results.rows.size()}, {"columns", ListColumns(study)}};
  data["keys"] = Json::array();
  for (const Variation& variation : study.variations) data["keys"].push_back(variation.key);
  data["shown"] = Json::array();
  for (const Metric metric : results.metrics) data["shown"].push_back(kMetrics[metric].name);
  for (int i = 0; i < kNumOutcomes; ++i) {
    const auto outcome = static_cast<Outcome>(i);
    data["outcomes"].push_back(NameOf(outcome));
    data["colors"].push_back(FindColor(outcome));
    data["held"].push_back(IsHeld(outcome));
  }
  data["theory"] = ListTheory(results);
  if (study.is_search() && !study.objectives.empty()) {
    data["history"] = ListHistory(results, data["theory"].contains("predicted"));
    data["maximize"] = study.objectives.front().maximize;
  }
  std::string bytes;
  const auto add = [&](double value) {
    char buffer[sizeof value];
    std::memcpy(buffer, &value, sizeof value);
    bytes.append(buffer, sizeof value);
  };
  for (const TrialRow* row : rows) {
    add(static_cast<double>(row->trial.number));
    add(static_cast<double>(row->trial.seed));
    add(static_cast<double>(row->result.outcome));
    for (const double parameter : row->trial.parameters) add(parameter);
    for (const double metric : row->result.metrics) add(metric);
  }
  Html html = EmbedJson("study-data", data);
  html += EmbedBytes("study-values", bytes);
  html += FormatHtml("<script>\n{}</script>\n", Html::Raw(kExplorerJs));
  return html;
}

}  // namespace dexcheck
