#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/cli/commands.h"
#include "harness/cli/json_matrix.h"
#include "harness/cli/output_file.h"
#include "harness/study/study_findings.h"
#include "harness/study/study_store.h"

namespace dexcheck::cli {
namespace {

void WriteJson(const std::string& file, const Json& json) {
  if (!file.empty()) OutputFile(file).Write(FormatJson(json));
}

int ShowTrial(const std::string& database, long number, const std::string& json) {
  const StudyStore store = StudyStore::Open(database);
  const Study& study = store.study();
  const std::optional<TrialRow> found = store.FindRow(number);
  if (!found) throw InputError(fmt::format("{}: trial {}: has no row", database, number));
  const TrialRow& row = *found;
  WriteJson(json, ToJson(study, row));
  if (json == "-") return kSuccess;
  fmt::print("trial {}, seed {}: {}{}{}\n", row.trial.number, row.trial.seed, NameOf(row.result.outcome),
             row.result.failure.empty() ? "" : ": ", row.result.failure);
  const auto print = [](std::string_view name, const std::string& value) {
    fmt::print("  {:<36}  {}\n", name, value);
  };
  for (size_t i = 0; i < study.variations.size(); ++i)
    print(study.variations[i].key, FormatValue(study.variations[i], row.trial.parameters[i]));
  for (size_t i = 0; i < kMetrics.size(); ++i) {
    const double value = row.result.metrics[i];
    if (std::isfinite(value))
      print(kMetrics[i].name, fmt::format("{:.6g}{}", value, ShowUnit(kMetrics[i].name)));
  }
  fmt::print("{}\n", MakeReplayCommand(study, row.trial));
  return kSuccess;
}

}  // namespace

void AddStudyReadCommands(CLI::App* study) {
  const auto database = std::make_shared<std::string>();
  const auto out = std::make_shared<std::string>();
  const auto add_database = [&](CLI::App* command) {
    AddOption(command, "DB", database.get(), "The study's database")->required();
  };

  CLI::App* const report = AddCommand(
      study, "report", "Write an HTML page of a study's results",
      {"dexcheck study report gains.sqlite", "dexcheck study report gains.sqlite --page gains.html"});
  add_database(report);
  AddOption(report, "--page FILE.html", out.get(), "The page (DB.html by default); - for standard output");
  const auto json = std::make_shared<std::string>();
  AddJsonOption(report, "the same data", json.get());
  SetAction(report, [=] {
    RequirePageName(*out);
    const StudySummary summary = SummariseStudy(StudyStore::Open(*database));
    WriteJson(*json, summary.json);
    if (!json->empty() && out->empty()) return kSuccess;
    OutputFile(out->empty() ? *database + ".html" : *out).Write(MakeStudyPage(summary));
    return kSuccess;
  });

  CLI::App* const show = AddCommand(
      study, "show", "Print one trial and the command that repeats it",
      {"dexcheck study show gains.sqlite 3", "dexcheck study show gains.sqlite 3 --json trial.json"});
  add_database(show);
  const auto number = std::make_shared<long>(0);
  AddOption(show, "TRIAL", number.get(), "Number of the trial")->required();
  AddJsonOption(show, "the trial", json.get());
  SetAction(show, [=] { return ShowTrial(*database, *number, *json); });

  CLI::App* const csv = AddCommand(
      study, "export", "Write all trials as CSV",
      {"dexcheck study export gains.sqlite", "dexcheck study export gains.sqlite --out gains.csv"});
  add_database(csv);
  AddOption(csv, "--out FILE.csv", out.get(), "The file (DB.csv by default); - for standard output");
  SetAction(csv, [=] {
    const StudyStore store = StudyStore::Open(*database);
    OutputFile file(out->empty() ? *database + ".csv" : *out);
    WriteStudyCsv(store, [&](std::string_view text) { file.Append(std::string(text)); });
    file.Finish();
    return kSuccess;
  });
}

}  // namespace dexcheck::cli
