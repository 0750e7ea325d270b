#include "harness/study/study_explorer.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "harness/study/explorer_assets.h"
#include "harness/study/halving_search.h"
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

Json ListHistory(const StudyResults& results) {
  Json history = Json::array();
  for (const JudgedPoint& point : JudgePoints(results.study, results.rows)) {
    const double value = ShowObjective(results.study.objectives.front(), point.judgement.objectives.front());
    history.push_back({{"value", value}, {"feasible", point.judgement.is_feasible() && !point.is_shortened}});
  }
  return history;
}

/// What (57) says beside the point that the study is about: the best one, else the first.
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
  return {{"knows", theory.knows}, {"turns", turns}, {"curves", curves}, {"place", place}};
}

/// For a script element: "</script>" must not be in it.
std::string Dump(const Json& json) {
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  for (size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at))
    text.replace(at, 1, "\\u003c");
  return text;
}

}  // namespace

Html MakeExplorerStyle() { return Html::Raw(kExplorerCss); }

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
        "constraints.</p></section>\n";
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
      "id=\"explore-numbers\"></p><p>Its run, with its film:</p><pre id=\"explore-command\"></pre><p>What "
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
  // Of successive halving: from which trial on they last how long.
  data["rounds"] = Json::array();
  long first = 0;
  const std::vector<long> counts = CountPointsOfRounds(study.search);
  for (size_t round = 0; round < counts.size(); ++round) {
    data["rounds"].push_back({{"first", first}, {"duration", study.search.durations[round]}});
    first += counts[round] * CountTrialsOfPoint(study);
  }
  if (study.is_search() && !study.objectives.empty()) {
    data["history"] = ListHistory(results);
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
  return FormatHtml(
      "<script type=\"application/json\" id=\"study-data\">{}</script>\n<script type=\"text/plain\" "
      "id=\"study-values\">{}</script>\n<script>\n{}</script>\n",
      Html::Raw(Dump(data)), Html::Raw(EncodeBase64(bytes)), Html::Raw(kExplorerJs));
}

}  // namespace dexcheck
