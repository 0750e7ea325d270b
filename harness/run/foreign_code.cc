#include "harness/run/foreign_code.h"

#include <pthread.h>

#include <chrono>
#include <cstring>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

constexpr size_t kStackSize = size_t{1} << 16U;
/// In a time limit. Looks are counted, not time, so that a process that was stopped for a while hangs in
/// nothing.
constexpr int kLooks = 8;

/// The one that exists. Handlers have no other way to it.
ForeignCode* the_one = nullptr;

}  // namespace

ForeignCode::ForeignCode(double time_limit)
    : time_limit_(time_limit), caller_(pthread_self()), stack_(kStackSize) {
  const stack_t stack{.ss_sp = stack_.data(), .ss_flags = 0, .ss_size = stack_.size()};
  ::sigaltstack(&stack, &old_stack_);
  the_one = this;
  struct sigaction action {};
  action.sa_handler = &ForeignCode::Handle;
  action.sa_flags = SA_ONSTACK | SA_NODEFER;  // since a handler may never return
  for (size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &action, &old_actions_[i]);
  watch_ = std::thread([this] { Watch(); });
}

ForeignCode::~ForeignCode() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
  }
  ends_.notify_one();
  watch_.join();
  for (size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &old_actions_[i], nullptr);
  ::sigaltstack(&old_stack_, nullptr);
  the_one = nullptr;
}

void ForeignCode::Enter(int patience) {
  patience_.store(patience, std::memory_order_relaxed);
  call_.fetch_add(1, std::memory_order_release);
}

void ForeignCode::Leave() { call_.fetch_add(1, std::memory_order_release); }

void ForeignCode::Handle(int signal) {
  ForeignCode& one = *the_one;
  const long call = one.call_.load(std::memory_order_relaxed);
  const bool in_call = call % 2 == 1 && ::pthread_equal(::pthread_self(), one.caller_) != 0;
  if (signal == SIGALRM) {
    // It may come when the call is over.
    if (!in_call || one.stuck_.load(std::memory_order_relaxed) != call) return;
  } else if (!in_call) {
    for (size_t i = 0; i < kSignals.size(); ++i) {
      if (kSignals[i] == signal) ::sigaction(signal, &one.old_actions_[i], nullptr);
    }
    ::raise(signal);
    return;
  }
  one.signal_ = signal;
  one.Leave();
  siglongjmp(one.return_, 1);
}

std::string ForeignCode::Explain() const {
  if (signal_ != SIGALRM) return "crashed (" + std::string(::strsignal(signal_)) + ")";
  return "did not return within " + FormatNumber(patience_.load() * time_limit_) + " s";
}

void ForeignCode::Watch() {
  // What the terminal or a scheduler sends is for the thread that runs.
  sigset_t all;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, nullptr);
  long seen = 0;
  int looks = 0;
  std::unique_lock<std::mutex> lock(mutex_);
  while (!ends_.wait_for(lock, std::chrono::duration<double>(time_limit_ / kLooks),
                         [this] { return ending_; })) {
    const long call = call_.load(std::memory_order_acquire);
    looks = call == seen ? looks + 1 : 0;
    seen = call;
    if (call % 2 == 0 || looks < kLooks * patience_.load(std::memory_order_relaxed)) continue;
    stuck_.store(call, std::memory_order_relaxed);
    ::pthread_kill(caller_, SIGALRM);
  }
}

}  // namespace dexcheck
