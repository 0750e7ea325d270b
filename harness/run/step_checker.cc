#include "harness/run/step_checker.h"

#include <utility>

namespace dexcheck {

StepChecker::StepChecker(const StepRecord& like, std::function<void(StepRecord*)> check)
    : check_(std::move(check)), step_(like), model_(*like.model), thread_([this] { Work(); }) {}

void StepChecker::Start(const StepRecord& step) {
  original_ = &step;
  is_pending_ = true;
  has_copied_.store(false, std::memory_order_relaxed);
  thread_.Start();
}

void StepChecker::AwaitCopy() const {
  while (!has_copied_.load(std::memory_order_acquire)) {
  }
}

void StepChecker::Await() {
  is_pending_ = false;
  thread_.Wait();
}

void StepChecker::Work() {
  model_ = *original_->model;
  step_ = *original_;
  step_.model = &model_;
  has_copied_.store(true, std::memory_order_release);
  check_(&step_);
}

}  // namespace dexcheck
