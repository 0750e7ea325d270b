#pragma once

// What a study finds, in sentences.

#include <string>
#include <vector>

#include "harness/study/search.h"
#include "harness/study/study_store.h"
#include "harness/study/trial.h"

namespace dexcheck {

/// "control.K_p = 4000, control.K_v = 126".
std::string DescribeValues(const Study& study, const std::vector<double>& values);

/// A point's objective as the user wrote it: of `maximize` with its own sign again.
double ShowObjective(const Study& study, const JudgedPoint& point, size_t objective = 0);

/// What the trials say to the study's question, one sentence each; empty for a study without one.
/// @param rows of all trials that are done.
std::vector<std::string> ListFindings(const Study& study, const std::vector<TrialRow>& rows);

/// Of a study of a motion of joints with one objective: TOML that may take the place of the scenario's
/// [control], with the best point's gains; your gains, the metrics and what keeps other points from being
/// better as comments. Empty of another study, and where no point is feasible.
std::string MakeGainCard(const StudyInputs& inputs, const std::vector<TrialRow>& rows);

// How far a study has come, while it runs or after.

struct StudyProgress {
  long done = 0;
  long total = 0;        ///< Of a search at most.
  bool is_over = false;  ///< Nothing is left to be made.
  std::string text;      ///< Lines: how far, outcomes, what is found so far.
};

StudyProgress FindProgress(const StudyStore& store);

}  // namespace dexcheck
