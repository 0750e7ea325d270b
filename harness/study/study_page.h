#pragma once

// What a study looks like elsewhere: what came of it as data, its pages, and its rows for other programs.

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "harness/study/error_budget.h"
#include "harness/study/study_store.h"

namespace dexcheck {

/// Most trials whose numbers are in a page; of more an even part, and the best.
constexpr size_t kMostShown = 20000;

struct StudySummary {
  /// What the study is, how far it has come, outcomes, findings, the best points, margins, sensitivities, and
  /// how (57) agrees. Its keys are in the README.
  nlohmann::ordered_json json;
  /// Doubles, row by row, of the trials that are shown: the numbers of json["columns"].
  std::string values;
};

/// Of all trials that are done.
StudySummary SummariseStudy(const StudyStore& store);

/// One HTML page that loads nothing else: what the study finds, outcomes and metrics over the varied keys,
/// the best trials, and the command that repeats each.
/// @param renew seconds after which a browser loads the page again; 0 for never.
std::string MakeStudyPage(const StudySummary& summary, double renew = 0.0);

/// A page with the budget's chart and table.
std::string MakeBudgetPage(const ErrorBudget& budget);

// Built into the program.
extern const char* const kStudyCss;
extern const char* const kStudyHtml;
extern const char* const kStudyJs;
extern const char* const kBudgetHtml;
extern const char* const kBudgetJs;

/// A key's value: a number, or the text that the number stands for.
nlohmann::ordered_json ShowValue(const Variation& variation, double value);

/// One trial, with the command that repeats it.
nlohmann::ordered_json ToJson(const Study& study, const TrialRow& row);

/// The command that repeats a trial, with its video.
std::string MakeReplayCommand(const Study& study, const Trial& trial);

/// Comma-separated values with a head: trial, seed, the keys, outcome, failure, the metrics, machine. Numbers
/// read back as the same doubles; what does not exist is empty.
/// @param write takes the text piece by piece.
void WriteStudyCsv(const StudyStore& store, const std::function<void(std::string_view)>& write);

}  // namespace dexcheck
