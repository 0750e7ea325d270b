#include "harness/run/foreign_code.h"

#include <pthread.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstring>

#include "controller/common/text.h"

namespace dexcheck {
namespace {

/// In a time limit. Looks are counted, not time, so that a process that was stopped for a while hangs in
/// nothing.
constexpr int kLooks = 8;

constexpr std::array<int, 6> kSignals = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGALRM};

/// What the process has once, however many objects there are.
struct Handlers {
  int users = 0;
  alignas(std::max_align_t) std::array<char, size_t{1} << 16U> stack{};  // since the caller's may be full
  stack_t old_stack{};
  std::array<struct sigaction, kSignals.size()> old_actions{};
};
Handlers handlers;

/// The one that made the last call. Handlers have no other way to it.
ForeignCode* the_one = nullptr;

/// The stack is a thread's own.
void UseStack(stack_t* old) {
  const stack_t stack{.ss_sp = handlers.stack.data(), .ss_flags = 0, .ss_size = handlers.stack.size()};
  ::sigaltstack(&stack, old);
}

void InstallHandlers(void (*handle)(int)) {
  if (handlers.users++ > 0) return;
  UseStack(&handlers.old_stack);
  struct sigaction action {};
  action.sa_handler = handle;
  action.sa_flags = SA_ONSTACK | SA_NODEFER;  // since a handler may never return
  for (size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &action, &handlers.old_actions[i]);
}

void RestoreHandlers() {
  if (--handlers.users > 0) return;
  for (size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &handlers.old_actions[i], nullptr);
  ::sigaltstack(&handlers.old_stack, nullptr);
}

}  // namespace

ForeignCode::ForeignCode(double time_limit) : time_limit_(time_limit), caller_(pthread_self()) {
  InstallHandlers(&ForeignCode::Handle);
  watch_ = std::thread([this] { Watch(); });
}

ForeignCode::~ForeignCode() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
  }
  ends_.notify_one();
  watch_.join();
  RestoreHandlers();
  if (the_one == this) the_one = nullptr;
}

void ForeignCode::Enter(int patience) {
  the_one = this;
  if (const pthread_t self = ::pthread_self(); ::pthread_equal(self, caller_) == 0) {
    caller_ = self;
    UseStack(nullptr);
  }
  patience_.store(patience, std::memory_order_relaxed);
  call_.fetch_add(1, std::memory_order_release);
}

void ForeignCode::Leave() { call_.fetch_add(1, std::memory_order_release); }

void ForeignCode::Handle(int signal) {
  ForeignCode* const one = the_one;
  const long call = one == nullptr ? 0 : one->call_.load(std::memory_order_relaxed);
  const bool in_call = call % 2 == 1 && ::pthread_equal(::pthread_self(), one->caller_) != 0;
  if (signal == SIGALRM) {
    // It may come when the call is over.
    if (!in_call || one->stuck_.load(std::memory_order_relaxed) != call) return;
  } else if (!in_call) {
    for (size_t i = 0; i < kSignals.size(); ++i) {
      if (kSignals[i] == signal) ::sigaction(signal, &handlers.old_actions[i], nullptr);
    }
    ::raise(signal);
    return;
  }
  one->signal_ = signal;
  one->Leave();
  siglongjmp(one->return_, 1);
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
