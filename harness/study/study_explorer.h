#pragma once

// The part of a study's page that is looked at with a script: any two quantities, all keys, a table.

#include "harness/report/html.h"
#include "harness/study/study_figures.h"

namespace dexcheck {

/// Most trials whose numbers are in the page; of more an even part, and the best.
constexpr size_t kMostExplored = 20000;

/// The section, without its script.
Html MakeExplorer(const StudyResults& results);

/// Numbers and script.
Html MakeExplorerScript(const StudyResults& results);

}  // namespace dexcheck
