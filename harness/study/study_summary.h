#pragma once

// What came of a study, as data: for its page and for other programs.

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

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

/// One trial, with the command that repeats it.
nlohmann::ordered_json ToJson(const Study& study, const TrialRow& row);

/// The command that repeats a trial, with its video.
std::string MakeReplayCommand(const Study& study, const Trial& trial);

// A study's rows for other programs.

/// A text in quotes where a comma, a quote or a line's end needs them. One that a spreadsheet would take for
/// a formula gets an apostrophe, which makes it a text there.
std::string QuoteField(const std::string& text);

/// Comma-separated values with a head: trial, seed, the keys, outcome, failure, the metrics, machine. Numbers
/// read back as the same doubles; what does not exist is empty.
/// @param write takes the text piece by piece.
void WriteStudyCsv(const StudyStore& store, const std::function<void(std::string_view)>& write);

}  // namespace dexcheck
