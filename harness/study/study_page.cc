#include "harness/study/study_page.h"

#include "harness/report/page_assets.h"
#include "harness/report/page_frame.h"
#include "harness/study/study_assets.h"

namespace dexcheck {
namespace {

/// @param html of the body. @param data that the script draws.
std::string MakePage(const std::string& title, const char* html, const Html& data, const char* script,
                     double renew) {
  Html page = BeginPage(title, Html::Raw(kStudyCss), renew);
  page += Html::Raw(html);
  page += data;
  for (const char* one : {kChartJs, kChartsJs, script})
    page += FormatHtml("<script>\n{}\n</script>\n", Html::Raw(one));
  page += "</body>\n</html>\n";
  return page.markup();
}

}  // namespace

std::string MakeStudyPage(const StudySummary& summary, double renew) {
  Html data = EmbedJson("study-data", summary.json);
  data += EmbedBytes("study-values", summary.values);
  const auto name = summary.json.at("name").get<std::string>();
  return MakePage(name + " – study", kStudyHtml, data, kStudyJs, renew);
}

std::string MakeBudgetPage(const ErrorBudget& budget) {
  return MakePage("error budget of " + budget.scenario, kBudgetHtml, EmbedJson("budget-data", ToJson(budget)),
                  kBudgetJs, /*renew=*/0.0);
}

}  // namespace dexcheck
