#pragma once

// Calls into code that is not this program's: what crashes or hangs there comes back as words.

#include <setjmp.h>
#include <signal.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace dexcheck {

/// While one exists, SIGSEGV and its like, and SIGALRM, are taken; those that do not come from a call go
/// where they went before. After a call that crashed or hung nothing of what was called may be used again,
/// not even its destructor: it was left in the middle, with its locks and its half-made objects. Calls are
/// made one at a time in a process, and cost some 20 ns.
class ForeignCode {
 public:
  /// @param time_limit of a call, s.
  explicit ForeignCode(double time_limit);
  ~ForeignCode();
  ForeignCode(const ForeignCode&) = delete;
  ForeignCode& operator=(const ForeignCode&) = delete;

  /// Exceptions pass through. @param patience how many times the time limit this call may take.
  /// @return empty, or "crashed (Segmentation fault)", "did not return within 1 s".
  template <typename Work>
  [[nodiscard]] std::string Call(const Work& work, int patience = 1) {
    if (sigsetjmp(return_, /*savemask=*/0) != 0) return Explain();
    Enter(patience);
    try {
      work();
    } catch (...) {
      Leave();
      throw;
    }
    Leave();
    return {};
  }

 private:
  static void Handle(int signal);
  void Enter(int patience);
  void Leave();
  [[nodiscard]] std::string Explain() const;
  /// Sends SIGALRM to the thread that calls when one call is found at too many looks.
  void Watch();

  double time_limit_;
  sigjmp_buf return_{};
  volatile sig_atomic_t signal_ = 0;  // that ended the call
  std::atomic<pthread_t> caller_;

  std::atomic<long> call_{0};   // 1, 3, ... while one is made
  std::atomic<long> stuck_{0};  // the call that takes too long
  std::atomic<int> patience_{1};
  std::mutex mutex_;
  std::condition_variable ends_;
  bool ending_ = false;
  std::thread watch_;
};

}  // namespace dexcheck
