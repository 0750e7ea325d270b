#include "harness/diagnosis/search_limit.h"

#include <pthread.h>

#include <ctime>

#include "harness/base/interrupts.h"

namespace dexcheck {
namespace {

/// Key of the limit of a thread's searches; null for none. The Python module, a shared library, has
/// this object, too, and takes no thread_local of it.
pthread_key_t GetKey() {
  static const pthread_key_t key = [] {
    pthread_key_t made{};
    ::pthread_key_create(&made, nullptr);
    return made;
  }();
  return key;
}

double ReadProcessorTime() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

SearchLimit::SearchLimit(double seconds)
    : end_(ReadProcessorTime() + seconds), was_interrupted_(IsInterrupted()) {
  ::pthread_setspecific(GetKey(), this);
}

SearchLimit::~SearchLimit() { ::pthread_setspecific(GetKey(), nullptr); }

bool SearchLimit::IsOver() {
  auto* const limit = static_cast<SearchLimit*>(::pthread_getspecific(GetKey()));
  if (limit == nullptr) return false;
  const bool is_interrupted = IsInterrupted() && !limit->was_interrupted_;
  limit->has_ended_ = limit->has_ended_ || is_interrupted || ReadProcessorTime() > limit->end_;
  return limit->has_ended_;
}

}  // namespace dexcheck
