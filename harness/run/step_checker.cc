#include "harness/run/step_checker.h"

#include <utility>

namespace dexcheck {

StepChecker::StepChecker(const StepRecord& like, std::function<void(StepRecord*)> check)
    : check_(std::move(check)), step_(like), model_(*like.model), thread_([this] { Run(); }) {}

StepChecker::~StepChecker() {
  AwaitChange(kWorking);
  Set(kQuit);
  thread_.join();
}

void StepChecker::Start(const StepRecord& step) {
  step_ = step;
  const bool stays = step.model != last_ && step.model == before_last_;
  before_last_ = std::exchange(last_, step.model);
  if (!stays) {
    model_ = *step.model;
    step_.model = &model_;
  }
  is_pending_ = true;
  Set(kWorking);
}

void StepChecker::Await() {
  is_pending_ = false;
  AwaitChange(kWorking);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void StepChecker::AwaitChange(State from) const {
  // Sleeping and waking takes longer than a step: the thread spins for some of them, and yields its core.
  constexpr int kSpins = 5000, kAlone = 200;
  for (int i = 0; i < kSpins; ++i) {
    if (state_.load(std::memory_order_acquire) != from) return;
    if (i >= kAlone) {
      std::this_thread::yield();
    } else {
#ifdef __x86_64__
      __builtin_ia32_pause();  // lets the other thread of the core go first
#endif
    }
  }
  state_.wait(from, std::memory_order_acquire);
}

void StepChecker::Set(State state) {
  state_.store(state, std::memory_order_release);
  state_.notify_one();
}

void StepChecker::Run() {
  while (true) {
    AwaitChange(kIdle);
    if (state_.load(std::memory_order_acquire) == kQuit) return;
    try {
      check_(&step_);
    } catch (...) {
      failure_ = std::current_exception();
    }
    Set(kIdle);
  }
}

}  // namespace dexcheck
