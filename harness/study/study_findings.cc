#include "harness/study/study_findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/report/page_frame.h"
#include "harness/run/joint_margins.h"
#include "harness/study/sampling.h"

namespace dexcheck {

namespace {

std::string CountPoints(size_t count) { return fmt::format("{} point{}", count, count == 1 ? "" : "s"); }

/// "control.K_p = 4000, control.K_v = 126".
std::string DescribeValues(const Study& study, const std::vector<double>& values) {
  std::string text;
  for (size_t i = 0; i < values.size(); ++i) {
    const Variation& variation = study.variations[i];
    text += fmt::format(
        "{}{} = {}", i == 0 ? "" : ", ", variation.key,
        variation.labels.empty() ? fmt::format("{:.6g}", values[i]) : FormatValue(variation, values[i]));
  }
  return text;
}

/// Names those keys of the best point that would go on past their ranges.
std::string DescribeEdges(const Study& study, const std::vector<double>& values) {
  constexpr double kAtEnd = 1e-3;  // of the range
  std::string text;
  for (size_t i = 0; i < study.variations.size(); ++i) {
    const Variation& variation = study.variations[i];
    const bool is_range = variation.values.empty();
    if (!variation.labels.empty() || (!is_range && variation.values.size() < 3)) continue;
    const double fraction = is_range ? FractionOf(variation, values[i])
                                     : (values[i] - variation.from) / (variation.to - variation.from);
    if (fraction > kAtEnd && fraction < 1.0 - kAtEnd) continue;
    text += (text.empty() ? " At an end of its range is " : ", ") + variation.key;
  }
  return text.empty() ? "" : text + ": a wider range may give a better one.";
}

/// @param points of which at least one is feasible.
std::string DescribeBest(const Study& study, const std::vector<JudgedPoint>& points) {
  const JudgedPoint& best = *SortFeasible(points).front();
  const Objective& objective = study.objectives.front();
  const std::string unit = ShowUnit(objective.expression);
  std::string text =
      fmt::format("The {} {} of {} is {:.4g}{}, at {} (trial {}).", objective.maximize ? "largest" : "least",
                  Describe(objective), CountPoints(points.size()), ShowObjective(study, best), unit,
                  DescribeValues(study, best.values), best.number * CountTrialsOfPoint(study));
  const JudgedPoint& first = points.front();
  if (study.is_search() && first.number == 0 && first.number != best.number) {
    if (!std::isfinite(ShowObjective(study, first))) {
      text += " The search began where it has no value.";
    } else {
      text += first.judgement.is_feasible()
                  ? fmt::format(" The search began with {:.4g}{}.", ShowObjective(study, first), unit)
                  : " The search began where a constraint does not hold.";
    }
  }
  return text + DescribeEdges(study, best.values);
}

std::string DescribeFront(const Study& study, const std::vector<JudgedPoint>& points) {
  const std::vector<const JudgedPoint*> front = FindFront(points);
  std::string text =
      fmt::format("Of {}, {} that no other one beats in everything:", CountPoints(points.size()),
                  front.size() == 1 ? "there is 1" : fmt::format("there are {}", front.size()));
  for (size_t i = 0; i < study.objectives.size(); ++i) {
    const auto [least, most] =
        std::minmax_element(front.begin(), front.end(), [&](const JudgedPoint* a, const JudgedPoint* b) {
          return a->judgement.objectives[i] < b->judgement.objectives[i];
        });
    text +=
        fmt::format("{} {} from {:.4g} ({}) to {:.4g}{}", i == 0 ? "" : ";", Describe(study.objectives[i]),
                    ShowObjective(study, **least, i), DescribeValues(study, (*least)->values),
                    ShowObjective(study, **most, i), ShowUnit(study.objectives[i].expression));
  }
  return text + ".";
}

/// "0.000302 (0.00029 to 0.00034)": the median and the range. @param values not empty.
std::string ShowSpread(std::vector<double> values) {
  std::ranges::sort(values);
  const size_t half = values.size() / 2;
  const double median = values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
  return fmt::format("{:.3g} ({:.3g} to {:.3g})", median, values.front(), values.back());
}

/// Outcome for each value of a key without an order, of laws for example, each in several trials.
std::vector<std::string> DescribeSpreads(const Study& study, const std::vector<TrialRow>& rows) {
  std::vector<std::string> findings;
  if (study.is_search() || study.variations.size() != 1 || CountTrialsOfPoint(study) < 2) return findings;
  for (size_t i = 0; i < study.variations.front().labels.size(); ++i) {
    long all = 0, held = 0;
    std::array<std::vector<double>, kNumMetrics> metrics;
    for (const TrialRow& row : rows) {
      if (row.trial.parameters.front() != static_cast<double>(i)) continue;
      ++all;
      if (!IsHeld(row.result.outcome)) continue;
      ++held;
      for (size_t k = 0; k < metrics.size(); ++k) {
        if (std::isfinite(row.result.metrics[k])) metrics[k].push_back(row.result.metrics[k]);
      }
    }
    std::string text = fmt::format("{}: held in {} of {} trials",
                                   DescribeValues(study, {static_cast<double>(i)}), held, all);
    for (const std::string& name : study.metrics) {
      const std::vector<double>& values = metrics[FindMetric(name).value()];
      if (!values.empty()) text += fmt::format("; {} {}{}", name, ShowSpread(values), ShowUnit(name));
    }
    findings.push_back(text + (held > 0 ? ", medians and ranges." : "."));
  }
  return findings;
}

/// Probability of a failure in a sample with constraints.
std::string DescribeFailures(const Study& study, const std::vector<TrialRow>& rows) {
  long failures = 0;
  for (const TrialRow& row : rows) {
    if (!JudgePoint({}, study.constraints, {&row.result, 1}).is_feasible()) ++failures;
  }
  const Estimate estimate = CalcProbability(failures, static_cast<long>(rows.size()));
  return fmt::format(
      "{} of {} trials fail: {:.2g} %, with 95 % confidence between {:.2g} % and {:.2g} % "
      "(Clopper-Pearson{}).",
      failures, rows.size(), 100.0 * estimate.value, 100.0 * estimate.low, 100.0 * estimate.high,
      study.sample.method == SamplingMethod::kRandom
          ? ""
          : "; it holds for a random sample, a more even one scatters less");
}

/// Names what keeps points that would be better than `best`, or came to no end, from being feasible, by how
/// many trials.
std::string DescribeLimits(const Study& study, const std::vector<TrialRow>& rows,
                           const std::vector<JudgedPoint>& points, double best) {
  std::map<std::string, int> limits;
  for (const JudgedPoint& point : points) {
    const double value = point.judgement.objectives.front();
    const bool is_better = value < best || !std::isfinite(value);
    if (point.judgement.is_feasible() || !is_better) continue;
    for (const TrialRow& row : rows) {
      if (row.trial.number / CountTrialsOfPoint(study) != point.number) continue;
      if (!IsHeld(row.result.outcome)) ++limits[NameOf(row.result.outcome)];
      for (const Constraint& constraint : study.constraints)
        if (IsHeld(row.result.outcome) && CalcViolation(constraint, row.result) > 0.0)
          ++limits[constraint.text];
    }
  }
  std::string text;
  for (const auto& [limit, count] : limits)
    text += fmt::format("{}{} ({} trial{})", text.empty() ? "" : ", ", limit, count, count == 1 ? "" : "s");
  return text;
}

/// @param html of the body. @param data that the script draws.
std::string MakePage(const std::string& title, const char* html, const std::string& data,
                     const char* script) {
  return AssemblePage({.title = title,
                       .styles = {kStudyCss},
                       .markup = {html},
                       .data = data,
                       .scripts = {kChartJs, kChartsJs, script}});
}

}  // namespace

std::string MakeGainCard(const StudyInputs& inputs, const std::vector<TrialRow>& rows) {
  const Study& study = inputs.study;
  if (study.objectives.size() != 1) return "";
  if (!study.controller.empty()) return "";  // whose gains are its own
  const std::vector<JudgedPoint> points = JudgePoints(study, rows);
  const std::vector<const JudgedPoint*> feasible = SortFeasible(points);
  if (feasible.empty()) return "";
  const JudgedPoint& best = *feasible.front();
  const long number = best.number * CountTrialsOfPoint(study);
  const TrialRow& row =
      *std::ranges::find_if(rows, [&](const TrialRow& one) { return one.trial.number == number; });
  const Scenario scenario = MakeTrialScenario(inputs, row.trial);
  if (scenario.joint_task() == nullptr || scenario.controller.exists()) return "";
  std::string card = "# your gains:\n" + CommentLines(WriteJointControl(OpenScenario(inputs).Read(), 1.0));
  card += fmt::format("# best of {} points: {} {:.4g}{}\n", points.size(), Describe(study.objectives.front()),
                      ShowObjective(study, best), ShowUnit(study.objectives.front().expression));
  const auto& metrics = row.result.metrics;
  if (std::isfinite(metrics[kGainMargin]))  // of a robot on its feet margins are not judged
    card +=
        fmt::format("# margins, one torque at a time: gain {:.2f}, phase {:.1f} degrees, delay {:.2f} ms\n",
                    metrics[kGainMargin], RadToDeg(metrics[kPhaseMargin]), 1e3 * metrics[kDelayMargin]);
  card += fmt::format("# largest torque {:.3g} of its limit\n", metrics[kPeakEffort]);
  const std::string limits = DescribeLimits(study, rows, points, best.judgement.objectives.front()),
                    edges = DescribeEdges(study, best.values);
  if (!limits.empty()) card += "# limited by " + limits + "\n";
  if (!edges.empty()) card += "#" + edges + "\n";
  if (limits.empty() && edges.empty())
    card += "# limited by nothing in these ranges but the objective itself\n";
  return card + WriteJointControl(scenario, 1.0);
}

double ShowObjective(const Study& study, const JudgedPoint& point, size_t objective) {
  const double value = point.judgement.objectives[objective];
  return study.objectives[objective].maximize ? -value : value;
}

std::vector<std::string> ListFindings(const Study& study, const std::vector<TrialRow>& rows) {
  std::vector<std::string> findings;
  if (rows.empty()) return findings;
  findings = DescribeSpreads(study, rows);
  if (study.sample.method == SamplingMethod::kMorris) {
    for (const std::string& quantity : ListQuantities(study, rows))
      findings.push_back(Describe(study, AnalyseSensitivity(study, rows, quantity)));
    return findings;
  }
  if (study.sample.method != SamplingMethod::kGrid && !study.constraints.empty())
    findings.push_back(DescribeFailures(study, rows));
  if (study.objectives.empty()) return findings;
  const std::vector<JudgedPoint> points = JudgePoints(study, rows);
  if (points.empty()) return findings;
  if (SortFeasible(points).empty()) {
    findings.push_back(
        fmt::format("At none of {} all constraints hold: {}.", CountPoints(points.size()),
                    DescribeLimits(study, rows, points, std::numeric_limits<double>::infinity())));
  } else {
    findings.push_back(study.objectives.size() == 1 ? DescribeBest(study, points)
                                                    : DescribeFront(study, points));
  }
  return findings;
}

std::string DescribeProgress(const StudyStore& store) {
  const Study& study = store.study();
  long done = 0;
  std::string text;
  for (const auto& [outcome, count] : store.CountOutcomes()) {
    done += count;
    text += fmt::format("  {:<18}{:>7}\n", NameOf(outcome), count);
  }
  text = fmt::format("{}: {} of {}{} trials in {}\n", study.name, done, study.is_search() ? "at most " : "",
                     CountTrials(study), store.name()) +
         text;
  const bool has_question = study.is_search() || !study.objectives.empty() || !study.constraints.empty() ||
                            study.sample.method == SamplingMethod::kMorris;
  if (!has_question) return text;
  const std::vector<TrialRow> rows = store.ReadRows(0, /*with_machine=*/false);
  for (const std::string& finding : ListFindings(study, rows)) text += finding + "\n";
  return text;
}

std::string MakeStudyPage(const StudySummary& summary) {
  const auto name = summary.json.at("name").get<std::string>();
  return MakePage(name + " – study", kStudyHtml,
                  EmbedJson("study-data", summary.json) + EmbedBytes("study-values", summary.values),
                  kStudyJs);
}

std::string MakeBudgetPage(const ErrorBudget& budget) {
  return MakePage("error budget of " + budget.scenario, kBudgetHtml, EmbedJson("budget-data", ToJson(budget)),
                  kBudgetJs);
}

using Json = nlohmann::ordered_json;

Json ShowValue(const Variation& variation, double value) {
  return variation.labels.empty() ? Json(value) : Json(FormatValue(variation, value));
}

Json ToJson(const Study& study, const TrialRow& row) {
  Json json = {{"trial", row.trial.number},
               {"seed", row.trial.seed},
               {"outcome", NameOf(row.result.outcome)},
               {"failure", row.result.failure},
               {"keys", Json::object()},
               {"metrics", Json::object()},
               {"machine", row.machine},
               {"command", MakeReplayCommand(study, row.trial)}};
  for (size_t i = 0; i < study.variations.size(); ++i)
    json["keys"][study.variations[i].key] = ShowValue(study.variations[i], row.trial.parameters[i]);
  for (size_t i = 0; i < kMetrics.size(); ++i) json["metrics"][kMetrics[i].name] = row.result.metrics[i];
  return json;
}

std::string MakeReplayCommand(const Study& study, const Trial& trial) {
  std::string command = "dexcheck run " + QuoteForShell(study.scenario);
  if (!study.controller.empty()) command += " --controller " + QuoteForShell(study.controller);
  for (const std::string& setting : ListOverrides(study, trial))
    command += " --set " + QuoteForShell(setting);
  if (trial.seed != 0) command += fmt::format(" --seed {}", trial.seed);
  if (!study.check) command += " --no-check";
  return command + fmt::format(" --video --out trial-{}", trial.number);
}

void WriteStudyCsv(const StudyStore& store, const std::function<void(std::string_view)>& write) {
  const Study& study = store.study();
  std::string line = "trial,seed";
  for (const Variation& variation : study.variations) line += "," + QuoteField(variation.key);
  line += ",outcome,failure";
  for (const MetricInfo& metric : kMetrics) line += std::string(",") + metric.name;
  write(line + ",machine\n");
  store.ForEachRow([&](const TrialRow& row) {
    line = std::to_string(row.trial.number) + "," + std::to_string(row.trial.seed);
    for (size_t i = 0; i < study.variations.size(); ++i) {
      const std::string value = FormatValue(study.variations[i], row.trial.parameters[i]);
      line += "," + (study.variations[i].labels.empty() ? value : QuoteField(value));
    }
    line += std::string(",") + NameOf(row.result.outcome) + "," + QuoteField(row.result.failure);
    for (const double metric : row.result.metrics)
      line += "," + (std::isfinite(metric) ? FormatNumber(metric) : "");
    write(line + "," + QuoteField(row.machine) + "\n");
  });
}

}  // namespace dexcheck
