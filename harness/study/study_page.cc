#include "harness/study/study_page.h"

#include <fmt/format.h>

#include <cmath>

#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/csv.h"
#include "harness/report/page_assets.h"
#include "harness/report/page_frame.h"

namespace dexcheck {
namespace {

/// @param html of the body. @param data that the script draws.
std::string MakePage(const std::string& title, const char* html, const std::string& data, const char* script,
                     double renew) {
  return AssemblePage({.title = title,
                       .styles = {kStudyCss},
                       .markup = {html},
                       .data = data,
                       .scripts = {kChartJs, kChartsJs, script},
                       .renew = renew});
}

}  // namespace

std::string MakeStudyPage(const StudySummary& summary, double renew) {
  const auto name = summary.json.at("name").get<std::string>();
  return MakePage(name + " – study", kStudyHtml,
                  EmbedJson("study-data", summary.json) + EmbedBytes("study-values", summary.values),
                  kStudyJs, renew);
}

std::string MakeBudgetPage(const ErrorBudget& budget) {
  return MakePage("error budget of " + budget.scenario, kBudgetHtml, EmbedJson("budget-data", ToJson(budget)),
                  kBudgetJs, /*renew=*/0.0);
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
