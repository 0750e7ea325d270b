#pragma once

// What a study answers, in sentences.

#include <string>
#include <vector>

#include "harness/study/search_history.h"

namespace dexcheck {

/// "control.K_p = 4000, control.K_v = 126".
std::string DescribeValues(const Study& study, const std::vector<double>& values);

/// The value of an objective as the user wrote it: of `maximize` with its own sign again.
double ShowObjective(const Objective& objective, double value);

/// What the trials answer to the study's question, one sentence each; empty for a study without one.
/// @param rows of all trials that are done.
std::vector<std::string> AnswerStudy(const Study& study, const std::vector<TrialRow>& rows);

}  // namespace dexcheck
