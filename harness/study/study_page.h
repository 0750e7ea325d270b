#pragma once

#include <string>

#include "harness/study/error_budget.h"
#include "harness/study/study_summary.h"

namespace dexcheck {

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

}  // namespace dexcheck
