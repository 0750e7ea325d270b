#pragma once

// What came of a study, as data: for its page and for other programs.

#include <nlohmann/json.hpp>
#include <string>

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

}  // namespace dexcheck
