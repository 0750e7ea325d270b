#pragma once

// Findings of a study in sentences, its pages, and its rows for other programs.

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "harness/study/error_budget.h"
#include "harness/study/search.h"
#include "harness/study/study_store.h"
#include "harness/study/trial.h"

namespace dexcheck {

/// Most trials whose numbers are in a page; of more the trials of points that a hash draws, and the best.
constexpr size_t kMostShown = 20000;

struct StudySummary {
  /// The study, how far it has come, outcomes, findings, the best points and sensitivities. Its keys
  /// are in the README.
  nlohmann::ordered_json json;
  /// Doubles, row by row, of the trials that are shown: the numbers of json["columns"].
  std::string values;
};

/// Summarises all trials that are done.
StudySummary SummariseStudy(const StudyStore& store);

/// A point's objective as the user wrote it: of `maximize` with its own sign again.
double ShowObjective(const Study& study, const JudgedPoint& point, size_t objective = 0);

/// Answers of the trials to the study's question, one sentence each; empty for a study without one.
/// @param rows of all trials that are done.
std::vector<std::string> ListFindings(const Study& study, const std::vector<TrialRow>& rows);

/// The best gains of a study of a motion of joints with one objective: TOML that may take the place of the
/// scenario's [control], with the best point's gains; your gains, the metrics and what keeps other points
/// from being better as comments. Empty of another study, and where no point is feasible.
std::string MakeGainCard(const StudyInputs& inputs, const std::vector<TrialRow>& rows);

/// Lines: how far a study has come, its outcomes, and what is found so far.
std::string DescribeProgress(const StudyStore& store);

/// One HTML page that loads nothing else: what the study finds, outcomes and metrics over the varied keys,
/// the best trials, and the command that repeats each.
std::string MakeStudyPage(const StudySummary& summary);

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
