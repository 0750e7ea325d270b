#pragma once

// Trials in processes of their own: one that crashes costs no other.

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/study/study_store.h"

namespace dexcheck {

/// Processes that each make one trial. They end when this process does, however it ends.
class TrialPool {
 public:
  /// @param run makes a trial; called in the trial's process.
  TrialPool(int size, std::function<TrialResult(const Trial&)> run);
  /// Ends what still runs.
  ~TrialPool();
  TrialPool(const TrialPool&) = delete;
  TrialPool& operator=(const TrialPool&) = delete;

  [[nodiscard]] bool IsFull() const { return workers_.size() >= size_; }
  [[nodiscard]] bool IsEmpty() const { return workers_.empty(); }
  /// Trials that run now.
  [[nodiscard]] std::vector<long> ListRunning() const;

  /// Begins a trial; the pool must not be full. @throws Error when no process can be made.
  void Start(const Trial& trial);

  /// Waits a little for a trial to end; none when none did. A process that died by itself gives
  /// Outcome::kCrashed. @throws Error when a trial's process was killed from outside.
  std::optional<TrialRow> Wait();

 private:
  struct Worker {
    Trial trial;
    pid_t pid = -1;
    int results = -1;   // the pipe's end to read from
    int messages = -1;  // its standard error
    std::string received;
  };
  [[noreturn]] void Work(const Trial& trial, int results, int messages, pid_t parent) const;
  TrialRow Finish(size_t index);

  size_t size_;
  std::function<TrialResult(const Trial&)> run_;
  std::vector<Worker> workers_;
};

}  // namespace dexcheck
