#include "harness/study/study_page.h"

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

}  // namespace dexcheck
