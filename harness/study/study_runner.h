#pragma once

// Makes a study's trials: in processes of their own, several at a time, into the study's database.

#include <functional>
#include <map>
#include <optional>
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

// Trials in processes of their own. Nothing but memory is left of a trial in its process, so that rows do not
// depend on who made them.

/// A trial whose process has ended.
struct EndedTrial {
  TrialRow row;
  bool killed_from_outside = false;  ///< As EndedJob has it.
};

/// A ProcessPool of trials.
class TrialPool {
 public:
  /// @param run makes a trial; called in the trial's process.
  /// @param time_limit most processor time of a trial, s; 0 for any. One that takes more is ended and gives
  ///   Outcome::kTimedOut.
  TrialPool(int size, double time_limit, const std::function<TrialResult(const Trial&)>& run);

  [[nodiscard]] bool IsFull() const { return pool_.IsFull(); }
  [[nodiscard]] bool IsEmpty() const { return pool_.IsEmpty(); }
  /// Numbers of the trials that run now.
  [[nodiscard]] std::vector<long> ListRunning() const { return pool_.ListRunning(); }

  /// Begins a trial; the pool must not be full. @throws Error when no process can be made.
  void Start(const Trial& trial);

  /// Waits a little for a trial to end; none when none did. A process that died gives Outcome::kCrashed.
  std::optional<EndedTrial> Wait();

 private:
  double time_limit_;
  std::map<long, Trial> running_;
  ProcessPool pool_;
};

}  // namespace dexcheck
