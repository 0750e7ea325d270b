#include "harness/run/foreign_library.h"

#include <dlfcn.h>
#include <sys/time.h>

#include <algorithm>
#include <atomic>
#include <csignal>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/watched_process.h"

namespace dexcheck {
namespace {

/// Number of looks of the timer in a time limit. Looks are counted instead of time, so that a process that
/// was stopped for a while does not fail.
constexpr int kLooks = 4;

/// State that a timer of the process reads.
struct {
  int libraries = 0;
  std::string line;            // message for a call that does not return
  std::atomic<long> call = 0;  // 1, 3, ... while one is made
  std::atomic<int> patience = 1;
  std::atomic<long> seen = 0;
  std::atomic<int> looks = 0;
} timed;

void LookAtCall(int /*signal*/) {
  const long call = timed.call;
  timed.looks = call == timed.seen ? timed.looks + 1 : 0;
  timed.seen = call;
  if (call % 2 == 1 && timed.looks >= kLooks * timed.patience) FailAtOnce(timed.line);
}

/// Sets the period of the timer, s; 0 stops it.
void SetTimer(double seconds) {
  timeval period{};
  period.tv_sec = static_cast<time_t>(seconds);
  period.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - static_cast<double>(period.tv_sec)));
  const itimerval timer{.it_interval = period, .it_value = period};
  ::setitimer(ITIMER_REAL, &timer, nullptr);
}

}  // namespace

ForeignLibrary::TimedCall::TimedCall(int patience) {
  timed.patience.store(patience, std::memory_order_relaxed);
  timed.call.fetch_add(1, std::memory_order_release);
}

ForeignLibrary::TimedCall::~TimedCall() { timed.call.fetch_add(1, std::memory_order_release); }

void ForeignLibrary::Close::operator()(void* handle) const { dlclose(handle); }

ForeignLibrary::Timer::Timer(const OwnControllerSetup& setup) {
  constexpr double kShortest = 1e-6;  // s; a timer of 0 never looks
  ++timed.libraries;
  timed.line =
      setup.name + ": did not return in time (" + FormatNumber(setup.own.time_limit) + " s for a step)";
  struct sigaction action {};
  action.sa_handler = LookAtCall;
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGALRM, &action, nullptr);
  SetTimer(std::max(kShortest, setup.own.time_limit / kLooks));
}

ForeignLibrary::Timer::~Timer() {
  if (--timed.libraries == 0) SetTimer(0.0);
}

ForeignLibrary::ForeignLibrary(const OwnControllerSetup& setup) : name_(setup.name), timer_(setup) {
  Guard([&] { handle_.reset(dlopen(FindControllerFile(setup.own).c_str(), RTLD_NOW | RTLD_LOCAL)); },
        kPatience);
  if (handle_ == nullptr) throw InputError(name_ + ": " + dlerror());
}

void* ForeignLibrary::FindSymbol(const char* name) const { return dlsym(handle_.get(), name); }

}  // namespace dexcheck
