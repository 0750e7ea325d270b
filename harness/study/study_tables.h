#pragma once

// Tables of a study's page that say what some kinds of studies ask for.

#include "harness/report/html.h"
#include "harness/study/study_figures.h"

namespace dexcheck {

/// Which key matters, with `method = "saltelli"` or `"morris"`: a table for each quantity, the key that
/// matters most first; empty for other studies.
Html MakeSensitivityTables(const StudyResults& results);

/// How far each key can go, with `method = "margins"`, and where (57) turns; empty for other studies.
Html MakeMarginTable(const StudyResults& results);

}  // namespace dexcheck
