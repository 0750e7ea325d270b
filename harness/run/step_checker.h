#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <thread>

#include "harness/checks/step_record.h"

namespace dexcheck {

/// Makes the checks of one step at a time in a thread of its own, on a copy of its record (and of the
/// controller's model, unless the controller alternates between two models), so that the next step can go on.
class StepChecker {
 public:
  /// @param like a record whose model has the form of the copies. @param check makes the checks of a copy.
  StepChecker(const StepRecord& like, std::function<void(StepRecord*)> check);
  ~StepChecker();
  StepChecker(const StepChecker&) = delete;
  StepChecker& operator=(const StepChecker&) = delete;

  /// Begins with a step. Await must come before the next.
  void Start(const StepRecord& step);
  /// Waits until the checks are made. @throws their exceptions.
  void Await();
  /// Whether Await has not been called since Start.
  [[nodiscard]] bool is_pending() const { return is_pending_; }
  /// The copy, with the results of the checks.
  [[nodiscard]] const StepRecord& step() const { return step_; }

 private:
  enum State : int { kIdle, kWorking, kQuit };
  /// Waits until the state changes: a millisecond or so awake, then asleep.
  void AwaitChange(State from) const;
  void Set(State state);
  void Run();

  std::function<void(StepRecord*)> check_;
  StepRecord step_;
  GraspModel model_;  // a copy of one that the next step overwrites
  const GraspModel* last_ = nullptr;
  const GraspModel* before_last_ = nullptr;
  bool is_pending_ = false;
  std::exception_ptr failure_;
  std::atomic<State> state_ = kIdle;
  std::thread thread_;
};

/// Chooses whether checks have a thread of their own, by which way was faster lately: on a machine that is
/// busy with other work two threads wait for each other longer than one takes. Steps come in blocks; one
/// block tries the thread, one goes without it, and those that follow use the faster way.
class ThreadChoice {
 public:
  static constexpr long kBlock = 32, kBlocks = 64;

  /// Whether the next step's checks are made beside the step after it. @param now s, before the step.
  [[nodiscard]] bool Next(double now) {
    const long step = steps_++;
    if (step % kBlock != 0) return is_beside_;
    (is_beside_ ? beside_ : alone_) = now - begin_;
    begin_ = now;
    const long block = step / kBlock % kBlocks;
    is_beside_ = block == 0 || (block > 1 && beside_ < alone_);
    return is_beside_;
  }

 private:
  long steps_ = 0;
  bool is_beside_ = false;
  double begin_ = 0.0, beside_ = 0.0, alone_ = 0.0;  // s; the last block of each kind took
};

}  // namespace dexcheck
