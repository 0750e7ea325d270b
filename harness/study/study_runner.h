#pragma once

// Makes a study's trials: in processes of their own, several at a time, into the study's database. Nothing
// but memory is left of a trial in its process, so that rows do not depend on who made them.

#include <functional>
#include <vector>

#include "harness/base/process_pool.h"
#include "harness/study/study_store.h"

namespace dexcheck {

struct RunOptions {
  int jobs = 1;                               ///< Trials at a time.
  std::function<bool()> is_interrupted;       ///< Called often.
  std::function<void(long finished)> report;  ///< Called with the number of trials that are done.
};

/// Returns the trials that have no row.
std::vector<Trial> ListMissing(const std::vector<Trial>& trials, const StudyStore& store);

/// Makes those of the trials that have no row. Trials that other living processes have are left to them.
/// @throws Error when no process can be made, InputError when the database takes no more.
void RunTrials(const StudyInputs& inputs, const std::vector<Trial>& trials, const RunOptions& options,
               StudyStore* store);

/// Whether this program makes the same rows: the first, the middle and the last that came to a result of
/// their own are made once more, and compared.
bool MakesRowsAgain(const StudyInputs& inputs, const std::vector<TrialRow>& rows);

/// Makes a search's trials, batch by batch, until it is over or interrupted. Several processes may work on
/// one database: each waits for the others' part of a batch.
void RunSearch(const StudyInputs& inputs, const RunOptions& options, StudyStore* store);

}  // namespace dexcheck
