#include "harness/diagnosis/search_limit.h"

#include <ctime>

#include "harness/base/interrupts.h"

namespace dexcheck {
namespace {

double ReadProcessorTime() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// The limit of all searches; null for none.
SearchLimit* present_limit = nullptr;

}  // namespace

SearchLimit::SearchLimit(double seconds)
    : end_(ReadProcessorTime() + seconds), was_interrupted_(IsInterrupted()) {
  present_limit = this;
}

SearchLimit::~SearchLimit() { present_limit = nullptr; }

bool SearchLimit::IsOver() {
  if (present_limit == nullptr) return false;
  const bool is_interrupted = IsInterrupted() && !present_limit->was_interrupted_;
  present_limit->has_ended_ =
      present_limit->has_ended_ || is_interrupted || ReadProcessorTime() > present_limit->end_;
  return present_limit->has_ended_;
}

}  // namespace dexcheck
