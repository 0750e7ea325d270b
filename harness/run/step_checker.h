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

}  // namespace dexcheck
