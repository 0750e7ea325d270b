#pragma once

// How long a piece of work takes, its child processes included.

#include <sys/resource.h>

#include <chrono>

namespace dexcheck {

struct MeasuredTime {
  double wall = 0.0;       ///< s
  double processor = 0.0;  ///< Time of this process and of its children that have ended, s.
};

inline double ProcessorSeconds() {
  double seconds = 0.0;
  for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(who, &usage);
    for (const timeval& time : {usage.ru_utime, usage.ru_stime}) {
      seconds += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    }
  }
  return seconds;
}

template <typename Function>
MeasuredTime Measure(const Function& function) {
  const double processor = ProcessorSeconds();
  const auto start = std::chrono::steady_clock::now();
  function();
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return {wall, ProcessorSeconds() - processor};
}

}  // namespace dexcheck
