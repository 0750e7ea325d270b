#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "harness/study/study_store.h"

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

}  // namespace dexcheck
