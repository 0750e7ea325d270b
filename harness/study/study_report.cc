#include "harness/study/study_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "harness/base/shell.h"
#include "harness/report/page_frame.h"
#include "harness/study/explorer_assets.h"
#include "harness/study/search_history.h"
#include "harness/study/study_answer.h"
#include "harness/study/study_explorer.h"
#include "harness/study/study_figures.h"
#include "harness/study/study_tables.h"
#include "harness/study/study_theory.h"

namespace dexcheck {
namespace {

constexpr size_t kMostAsked = 2000;  // trials that theory is asked about

/// A failure without the time that it happened at, so that equal ones can be counted.
std::string WithoutTime(const std::string& failure) {
  constexpr std::string_view kSettling = " while settling";
  if (failure.ends_with(kSettling)) return failure.substr(0, failure.size() - kSettling.size());
  return failure.substr(0, failure.find(" at t = "));
}

class Report {
 public:
  explicit Report(const StudyStore& store)
      : store_(store), results_(store), tracked_(results_.ListTracked()), admitted_(tracked_) {
    std::erase_if(admitted_, [&](const TrialRow* row) {
      return !JudgePoint({}, results_.study.constraints, {&row->result, 1}).is_feasible();
    });
    for (const Variation& variation : results_.study.keys()) best_.heads.push_back(variation.key);
    best_order_ = results_.study.objectives.empty() ? FillByError(&best_) : FillByObjectives(&best_);
    // What the table leads to must be on the page.
    for (const auto& [row, cells] : best_.rows) results_.listed.push_back(row);
    std::sort(results_.listed.begin(), results_.listed.end());  // of one vector, by number
    results_.listed.erase(std::unique(results_.listed.begin(), results_.listed.end()), results_.listed.end());
  }

  std::string Make(double renew) {
    Html html = BeginPage(results_.study.name + " – study", Html::Raw(kStudyCss), renew);
    html += Head();
    Html body;
    if (results_.rows.empty()) {
      body += "<p>No trial is done yet.</p>\n";
    } else {
      for (const Html& part :
           {Answers(), MakeMarginTable(results_), MakeSensitivityTables(results_), Outcomes(), Maps(),
            Lines(), ErrorAgainstEffort(), MakeExplorer(results_), Best(), Trials()})
        body += part;
      html += LinkParts(body);
    }
    html += "<main>\n";
    html += body;
    html += "</main>\n";
    html += Footer();
    if (!results_.rows.empty()) html += MakeExplorerScript(results_);
    html += "</body>\n</html>\n";
    return html.markup();
  }

 private:
  [[nodiscard]] static Html MakeTile(const std::string& value, const Html& label) {
    return FormatHtml("<div class=\"card\"><b>{}</b><span>{}</span></div>\n", value, label);
  }

  [[nodiscard]] Html Head() const {
    const Study& study = results_.study;
    Html html = FormatHtml("<header>\n<h1><b>{}</b>{}{}</h1>\n<div class=\"tiles\">\n", study.name,
                           study.description.empty() ? "" : " – ", study.description);
    const long count = CountTrials(study);
    html +=
        MakeTile(fmt::format("{} of {}{}", results_.rows.size(), study.is_search() ? "at most " : "", count),
                 FormatHtml("trials of scenario {} are done", study.scenario));
    if (results_.rows.empty()) {
      html += "</div>\n</header>\n";
      return html;
    }
    html += MakeTile(fmt::format("{}", tracked_.size()), Html("tracked to their end, without slip"));
    if (study.objectives.size() == 1) {
      const Objective& objective = study.objectives.front();
      const std::optional<JudgedPoint> best = SummarisePoints(study, results_.rows).best;
      if (best) {
        html += MakeTile(FormatShort(ShowObjective(objective, best->judgement.objectives.front())) +
                             ShowUnit(objective.expression),
                         FormatHtml("{} {}", objective.maximize ? "largest" : "least", Describe(objective)));
      }
    } else if (study.objectives.empty() && !admitted_.empty()) {
      html += MakeTile(FormatShort(admitted_.front()->result.metrics[results_.error]) +
                           (results_.of_joints() ? " rad" : " m"),
                       FormatHtml("least rms {} error, <a href=\"{}\">trial {}</a>", NameOfError(),
                                  LinkTo(*admitted_.front()), admitted_.front()->trial.number));
    }
    html += "</div>\n</header>\n";
    return html;
  }

  /// A link to each part that the page has, in its order.
  [[nodiscard]] static Html LinkParts(const Html& body) {
    constexpr std::array<std::pair<const char*, const char*>, 9> kParts = {{{"margins", "Margins"},
                                                                            {"effects", "Which key matters"},
                                                                            {"outcomes", "Outcomes"},
                                                                            {"maps", "Maps"},
                                                                            {"lines", "Lines"},
                                                                            {"effort", "Effort"},
                                                                            {"explore", "Look closer"},
                                                                            {"best", "Best"},
                                                                            {"trials", "Trials"}}};
    Html html("<nav><div>");
    for (const auto& [id, name] : kParts) {
      if (body.markup().find(fmt::format("id=\"{}\"", id)) == std::string::npos) continue;
      html += FormatHtml("<a href=\"#{}\">{}</a>", id, name);
    }
    html += "</div></nav>\n";
    return html;
  }

  /// What the study answers, first of all.
  [[nodiscard]] Html Answers() const {
    const std::vector<std::string> answers = AnswerStudy(results_.study, results_.rows);
    if (answers.empty()) return {};
    Html html("<section class=\"card answers\" id=\"answers\">\n");
    for (const std::string& answer : answers) html += FormatHtml("<p>{}</p>\n", answer);
    html += "</section>\n";
    return html;
  }

  [[nodiscard]] Html Outcomes() const {
    std::map<Outcome, long> counts;
    for (const TrialRow& row : results_.rows) ++counts[row.result.outcome];
    Html html(
        "<h2 id=\"outcomes\">Outcomes</h2>\n<div class=\"grid\">\n<div class=\"card\">\n<table "
        "class=\"counts\">\n");
    for (const auto& [outcome, count] : counts) {
      html += FormatHtml(
          "<tr><td><span class=\"key\" style=\"background:{}\"></span> {}</td><td class=\"value "
          "number\">{}</td></tr>\n",
          FindColor(outcome), NameOf(outcome), count);
    }
    html += Html("</table>\n</div>\n");
    const Html departures = Departures();
    if (!departures.empty()) html += FormatHtml("<div class=\"card\">\n{}</div>\n", departures);
    html += Html("</div>\n");
    return html;
  }

  [[nodiscard]] std::string NameOfError() const { return results_.of_joints() ? "joint" : "position"; }

  [[nodiscard]] static std::string ExplainDivergence(const TrialRow& row) {
    if (row.result.metrics[kErrorGrowth] > 1.0) return "the error grew";
    return fmt::format("the rms error is above {} m", kLostTrack);
  }

  /// Where theory is stable and the run was not held to its end, by reason. Theory is that of an object.
  [[nodiscard]] Html Departures() const {
    if (results_.of_joints()) return {};
    std::map<std::string, long> reasons;
    long agree = 0;
    long asked = 0;
    const size_t every = (results_.rows.size() + kMostAsked - 1) / kMostAsked;
    for (size_t i = 0; i < results_.rows.size(); i += every) {
      const TrialRow& row = results_.rows[i];
      if (row.result.outcome == Outcome::kRefused) continue;
      ++asked;
      const bool stable = IsStableInTheory(results_.inputs, row.trial.parameters);
      if (stable == IsHeld(row.result.outcome)) {
        ++agree;
        continue;
      }
      std::string reason = WithoutTime(row.result.failure);
      if (reason.empty()) reason = ExplainDivergence(row);
      ++reasons[stable ? "stable in theory, but " + reason
                       : "unstable in theory, but held to the end of the run"];
    }
    Html html = FormatHtml(
        "<p>The sampled error dynamics E_ddot + K_v E_dot + K_p E = 0, stepped as the engine steps, tell {} "
        "of {} "
        "trials rightly.</p>\n",
        agree, asked);
    if (reasons.empty()) return html;
    html += "<p>Where the plant departs from them, and why:</p>\n<table class=\"counts\">\n";
    for (const auto& [reason, count] : reasons) {
      html += FormatHtml("<tr><td>{}</td><td class=\"value number\">{}</td></tr>\n", reason, count);
    }
    html += "</table>\n";
    return html;
  }

  /// What is drawn over the maps.
  [[nodiscard]] Html ExplainMaps(const Html& figure) const {
    Html text(
        "<span class=\"key rule\"></span> Measured boundary between runs that were held to their end and "
        "others; in the map of overshoot, between less and more than 1 %. ");
    if (figure.markup().find("class=\"dot\"") != std::string::npos) {
      text += Html(
          "Dots are theory: <span class=\"key dot\" style=\"background:#0b3c8c\"></span> the boundary of "
          "stability, <span class=\"key dot\" style=\"background:#fff\"></span> critical damping; in the map "
          "of overshoot, 1 %. ");
    } else if (!results_.of_joints()) {
      text += "The theoretical boundary of stability does not run through this range. ";
    }
    text += "Of several trials in one cell the worst is shown; grey: no value. ";
    return text;
  }

  [[nodiscard]] Html Maps() const {
    const Html outcomes = DrawOutcomes(results_);
    if (outcomes.empty()) return {};
    const Study& study = results_.study;
    const bool is_grid = study.sample.method == SamplingMethod::kGrid && !study.is_search();
    return FormatHtml(
        "<h2 id=\"maps\">Over {} and {}</h2>\n<p class=\"soft\">{}Each {} leads to its trial and the command "
        "that repeats it.</p>\n<div class=\"grid\">\n{}{}</div>\n",
        study.variations[0].key, study.variations[1].key, is_grid ? ExplainMaps(outcomes) : Html(),
        is_grid ? "cell" : "point", outcomes, DrawMetrics(results_));
  }

  [[nodiscard]] Html Lines() const {
    const Html lines = DrawLines(results_);
    if (lines.empty()) return {};
    return FormatHtml(
        "<h2 id=\"lines\">Along {}</h2>\n<p class=\"soft\">Trials that were held to their end.</p>\n<div "
        "class=\"grid\">\n{}</div>\n",
        results_.study.variations[0].key, lines);
  }

  [[nodiscard]] Html ErrorAgainstEffort() const {
    const Html chart = DrawErrorAgainstEffort(results_);
    if (chart.empty()) return {};
    return FormatHtml(
        "<h2 id=\"effort\">Error against effort</h2>\n<p class=\"soft\">Trials that tracked, by the work of "
        "their motors. To the left of the front nothing is had: less error costs more work.</p>\n<div "
        "class=\"grid\">\n{}</div>\n",
        chart);
  }

  [[nodiscard]] Html Best() const {
    if (best_order_.empty()) return {};
    Html html = FormatHtml("<h2 id=\"best\">Best</h2>\n<p class=\"soft\">{}</p>\n", best_order_);
    if (best_.rows.empty()) return html;
    html += Html("<div class=\"card scroll\"><table>\n<tr><th class=\"value\">trial</th>");
    for (const std::string& head : best_.heads) html += FormatHtml("<th class=\"value\">{}</th>", head);
    html += "</tr>\n";
    for (const auto& [row, cells] : best_.rows) {
      html +=
          FormatHtml("<tr><td class=\"value\"><a href=\"{}\">{}</a></td>", LinkTo(*row), row->trial.number);
      for (const std::string& cell : cells) html += FormatHtml("<td class=\"value number\">{}</td>", cell);
      html += "</tr>\n";
    }
    html += "</table></div>\n";
    return html;
  }

  struct BestTable {
    std::vector<std::string> heads;
    std::vector<std::pair<const TrialRow*, std::vector<std::string>>> rows;  ///< A cell for each head.
  };

  /// A cell for each of these values of the first keys.
  [[nodiscard]] std::vector<std::string> ShowKeys(const std::vector<double>& values) const {
    std::vector<std::string> cells;
    for (size_t i = 0; i < values.size(); ++i) {
      const Variation& variation = results_.study.variations[i];
      cells.push_back(variation.labels.empty() ? fmt::format("{:.6g}", values[i])
                                               : FormatValue(variation, values[i]));
    }
    return cells;
  }

  /// Of a study that says what it wants: points that fulfil the constraints, by the objective; of several
  /// objectives those that no other point beats in all. @return what the order is.
  std::string FillByObjectives(BestTable* table) const {
    const Study& study = results_.study;
    const std::vector<JudgedPoint> points = JudgePoints(study, results_.rows);
    const std::vector<const JudgedPoint*> best =
        study.objectives.size() == 1 ? SortFeasible(points) : FindFront(points);
    if (points.empty()) return "";
    if (best.empty()) return fmt::format("At none of {} points all constraints hold.", points.size());
    for (const Objective& objective : study.objectives)
      table->heads.push_back(Describe(objective) + ShowUnit(objective.expression));
    for (size_t i = 0; i < std::min(best.size(), kMostBest); ++i) {
      const JudgedPoint& point = *best[i];
      std::vector<std::string> cells = ShowKeys(point.values);
      for (size_t k = 0; k < study.objectives.size(); ++k) {
        const double value = ShowObjective(study.objectives[k], point.judgement.objectives[k]);
        cells.push_back(std::isfinite(value) ? fmt::format("{:.4g}", value) : "–");
      }
      const auto first = std::lower_bound(
          results_.rows.begin(), results_.rows.end(), point.number * CountTrialsOfPoint(study),
          [](const TrialRow& row, long number) { return row.trial.number < number; });
      table->rows.emplace_back(&*first, std::move(cells));
    }
    return (study.objectives.size() == 1
                ? fmt::format("By {} {}", study.objectives.front().maximize ? "the largest" : "the least",
                              Describe(study.objectives.front()))
                : std::string("Points that no other one beats in everything")) +
           fmt::format(", of {} points", points.size()) +
           (study.constraints.empty() ? "." : ", those at which all constraints hold.") +
           (CountTrialsOfPoint(study) > 1 ? " A point's trials begin with the one that is named." : "");
  }

  /// Of any other: trials by their error. @return what the order is.
  std::string FillByError(BestTable* table) const {
    if (tracked_.empty()) return "";
    for (size_t i = results_.study.num_keys(); i < results_.study.variations.size(); ++i)
      table->heads.push_back(results_.study.variations[i].key);
    std::vector<Metric> shown = {results_.error, kEnergy};
    for (const Metric metric : results_.metrics) {
      if (std::find(shown.begin(), shown.end(), metric) == shown.end()) shown.push_back(metric);
    }
    for (const Metric metric : shown) table->heads.push_back(LabelOf(metric));
    for (size_t i = 0; i < std::min(admitted_.size(), kMostBest); ++i) {
      const TrialRow& row = *admitted_[i];
      std::vector<std::string> cells = ShowKeys(row.trial.parameters);
      for (const Metric metric : shown) {
        const double value = row.result.metrics[metric];
        cells.push_back(std::isfinite(value) ? fmt::format("{:.4g}", value) : "–");
      }
      table->rows.emplace_back(&row, std::move(cells));
    }
    if (admitted_.empty())
      return fmt::format("In none of the {} trials that tracked all constraints hold.", tracked_.size());
    return fmt::format("By rms {} error, of the trials that tracked{}.", NameOfError(),
                       results_.study.constraints.empty() ? "" : " and fulfil the constraints");
  }

  [[nodiscard]] Html Trials() const {
    Html html(
        "<h2 id=\"trials\">Trials</h2>\n<p class=\"soft\">Each command repeats one trial, with its log, "
        "report and video.");
    if (!results_.lists_all()) {
      html += FormatHtml(
          " Here are {} of {} trials; <code>dexcheck study show DB NUMBER</code> tells of any other, "
          "<code>dexcheck study export DB</code> writes all as CSV.",
          results_.listed.size(), results_.rows.size());
    }
    html += "</p>\n<div class=\"card trials\">\n";
    for (const TrialRow* listed : results_.listed) {
      const TrialRow& row = *listed;
      std::string metrics;
      for (size_t i = 0; i < kMetrics.size(); ++i) {
        const double value = row.result.metrics[i];
        if (!std::isfinite(value)) continue;
        const std::string unit = kMetrics[i].unit;
        metrics += fmt::format("{}{} {:.4g}{}", metrics.empty() ? "" : "; ", kMetrics[i].name, value,
                               unit == "1" ? "" : " " + unit);
      }
      const std::string title = Describe(results_.study, row);
      html += FormatHtml(
          "<section class=\"trial\" id=\"trial-{}\"><a class=\"close\" href=\"#none\">close</a><b><span "
          "class=\"key\" "
          "style=\"background:{}\"></span> {}</b><br><small "
          "class=\"soft\">{}</small><pre>{}</pre></section>\n",
          row.trial.number, FindColor(row.result.outcome), title, metrics,
          MakeReplayCommand(results_.study, row.trial));
    }
    html += "</div>\n";
    return html;
  }

  [[nodiscard]] Html Footer() const {
    const std::string& revision = store_.Identify("git_revision");
    return FormatHtml("<footer>dexcheck {}{}{}, MuJoCo {}.</footer>\n", store_.Identify("dexcheck_version"),
                      revision.empty() ? "" : ", revision ", revision, store_.Identify("mujoco_version"));
  }

  const StudyStore& store_;
  StudyResults results_;
  std::vector<const TrialRow*> tracked_;
  std::vector<const TrialRow*> admitted_;  // of these, those that fulfil the constraints
  BestTable best_;
  std::string best_order_;  // empty without one
};

}  // namespace

std::string MakeReplayCommand(const Study& study, const Trial& trial) {
  std::string command = "dexcheck run " + QuoteForShell(study.scenario);
  for (const std::string& setting : ListOverrides(study, trial))
    command += " --set " + QuoteForShell(setting);
  if (trial.seed != 0) command += fmt::format(" --seed {}", trial.seed);
  if (!study.check) command += " --no-check";
  return command + fmt::format(" --video --out trial-{}", trial.number);
}

std::string MakeStudyReport(const StudyStore& store, double renew) { return Report(store).Make(renew); }

}  // namespace dexcheck
