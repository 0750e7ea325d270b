#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <thread>

#include "harness/checks/step_record.h"

namespace dexcheck {

/// Checks of one step at a time in a thread of their own, on a copy of its record (and of the controller's
/// model, unless that is at two places by turns), so that the next step can go on.
class StepChecker {
 public:
  /// @param like a record whose model says what copies look like. @param check makes the checks of a copy.
  StepChecker(const StepRecord& like, std::function<void(StepRecord*)> check);
  ~StepChecker();
  StepChecker(const StepChecker&) = delete;
  StepChecker& operator=(const StepChecker&) = delete;

  /// Begins with a step. Await comes before the next.
  void Start(const StepRecord& step);
  /// Until the checks are made. @throws what they threw.
  void Await();
  /// Whether Await has not been called since Start.
  [[nodiscard]] bool is_pending() const { return is_pending_; }
  /// The copy, with what the checks made of it.
  [[nodiscard]] const StepRecord& step() const { return step_; }

 private:
  enum State : int { kIdle, kWorking, kQuit };
  /// Until the state is another: a millisecond or so awake, then asleep.
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

}  // namespace dexcheck
