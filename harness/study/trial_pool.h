#pragma once

// Trials in processes of their own: one that crashes costs no other.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/base/worker_process.h"
#include "harness/log/log_file.h"
#include "harness/study/study_store.h"

namespace dexcheck {

/// A trial whose process has ended.
struct EndedTrial {
  TrialRow row;
  /// Its process was killed, by hand or by the system when memory is short: the trial may be tried again.
  bool killed_from_outside = false;
};

/// Processes that each make one trial. They end with the pool.
class TrialPool {
 public:
  /// @param run makes a trial; called in the trial's process.
  /// @param time_limit most processor time of a trial, s; 0 for any. One that takes more is ended and gives
  ///   Outcome::kTimedOut.
  TrialPool(int size, double time_limit, std::function<TrialResult(const Trial&)> run);

  [[nodiscard]] bool IsFull() const { return workers_.size() >= size_; }
  [[nodiscard]] bool IsEmpty() const { return workers_.empty(); }
  /// Trials that run now.
  [[nodiscard]] std::vector<long> ListRunning() const;

  /// Begins a trial; the pool must not be full. @throws Error when no process can be made.
  void Start(const Trial& trial);

  /// Waits a little for a trial to end; none when none did. A process that died gives Outcome::kCrashed.
  std::optional<EndedTrial> Wait();

 private:
  struct Worker {
    Trial trial;
    WorkerProcess process;
    FileDescriptor messages;  // its standard error
    std::string received;
    bool timed_out = false;
  };
  bool Work(const Trial& trial, int channel, int messages) const;
  void EndSlowTrials();
  EndedTrial Finish(size_t index);

  size_t size_;
  double time_limit_;
  std::function<TrialResult(const Trial&)> run_;
  std::vector<Worker> workers_;
};

}  // namespace dexcheck
