#pragma once

// Trials in processes of their own: one that crashes costs no other. A process makes one trial after another
// and keeps its memory between them; nothing else is left of a trial, so that rows do not depend on who made
// them.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/base/child_process.h"
#include "harness/log/log_file.h"
#include "harness/study/study_store.h"

namespace dexcheck {

/// A trial whose process has ended.
struct EndedTrial {
  TrialRow row;
  /// Its process was killed, by hand or by the system when memory is short: the trial may be tried again.
  bool killed_from_outside = false;
};

/// Processes that each make one trial at a time, begun when they are first needed. They end with the pool.
class TrialPool {
 public:
  /// @param run makes a trial; called in the trial's process.
  /// @param time_limit most processor time of a trial, s; 0 for any. One that takes more is ended and gives
  ///   Outcome::kTimedOut.
  TrialPool(int size, double time_limit, std::function<TrialResult(const Trial&)> run);

  [[nodiscard]] bool IsFull() const { return CountBusy() >= size_; }
  [[nodiscard]] bool IsEmpty() const { return CountBusy() == 0; }
  /// Trials that run now.
  [[nodiscard]] std::vector<long> ListRunning() const;

  /// Begins a trial; the pool must not be full. @throws Error when no process can be made.
  void Start(const Trial& trial);

  /// Waits a little for a trial to end; none when none did. A process that died gives Outcome::kCrashed.
  std::optional<EndedTrial> Wait();

 private:
  struct Worker {
    ChildProcess process;
    FileDescriptor messages;     // its standard error
    std::optional<Trial> trial;  // that it makes now
    std::string received;
    double begun = 0.0;  // its processor time when the trial began, s
    bool timed_out = false;
  };
  [[nodiscard]] size_t CountBusy() const;
  bool Work(int channel, int messages) const;
  Worker MakeWorker() const;
  void EndSlowTrials();
  std::optional<EndedTrial> TakeResult(Worker* worker) const;
  EndedTrial Bury(size_t index);

  size_t size_;
  double time_limit_;
  std::function<TrialResult(const Trial&)> run_;
  std::vector<Worker> workers_;
};

}  // namespace dexcheck
