#pragma once

// A study that was edited: which of its rows still belong to it.

#include <string>
#include <vector>

#include "harness/study/study_store.h"

namespace dexcheck {

/// What an edited study makes of a database's rows.
struct StudyChange {
  std::vector<TrialRow> rows;  ///< All of them, with the numbers that they have now; those that do not belong
                               ///< to it have negative ones.
  long kept = 0;               ///< Rows that belonged to it, and do.
  long brought_back = 0;       ///< Rows that had been set aside.
  long set_aside = 0;          ///< Rows that belonged to it and do not any more.
};

/// Why rows of one study cannot be rows of the other, whatever their parameters; empty when they can: trials
/// are made in the same way, and the same keys are varied. A search must be the same but for its number of
/// points.
std::string FindDifference(const Study& before, const Study& now);

/// Whether both list the same trials under the same numbers.
bool HasSameTrials(const Study& before, const Study& now);

/// Finds the rows' places in the study as it is now. The two must not differ (FindDifference).
/// @param rows of `before`, those that were set aside among them.
StudyChange ChangeStudy(const Study& before, const Study& now, std::vector<TrialRow> rows);

/// "12 trials are kept, 4 are set aside".
std::string Describe(const StudyChange& change);

}  // namespace dexcheck
