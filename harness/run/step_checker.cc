#include "harness/run/step_checker.h"

#include <utility>

namespace dexcheck {

StepChecker::StepChecker(const StepRecord& like, std::function<void(StepRecord*)> check)
    : check_(std::move(check)), step_(like), model_(*like.model), thread_([this] { check_(&step_); }) {}

void StepChecker::Start(const StepRecord& step) {
  step_ = step;
  const bool stays = step.model != last_ && step.model == before_last_;
  before_last_ = std::exchange(last_, step.model);
  if (!stays) {
    model_ = *step.model;
    step_.model = &model_;
  }
  is_pending_ = true;
  thread_.Start();
}

void StepChecker::Await() {
  is_pending_ = false;
  thread_.Wait();
}

}  // namespace dexcheck
