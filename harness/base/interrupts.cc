#include "harness/base/interrupts.h"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <string_view>

#include "harness/base/files.h"
#include "harness/base/watched_process.h"

namespace dexcheck {
namespace {

std::atomic<bool> catching = false;
std::atomic<bool> interrupted = false;
std::atomic<int> interrupted_exit_code = 0;
static_assert(std::atomic<int>::is_always_lock_free, "signal handlers may use only such atomics");

void Install(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  ::sigemptyset(&action.sa_mask);
  ::sigaction(signal, &action, nullptr);
}

bool IsIgnored(int signal) {
  struct sigaction action {};
  ::sigaction(signal, nullptr, &action);
  return action.sa_handler == SIG_IGN;
}

void Interrupt(int /*signal*/) {
  const int error = errno;
  if (catching.exchange(false)) {
    interrupted = true;
    errno = error;
    return;
  }
  RemoveTemporaryPaths();
  constexpr std::string_view kMessage = "dexcheck: interrupted\n";
  // The process ends, whether anybody reads this or not.
  [[maybe_unused]] const ssize_t ignored = ::write(STDERR_FILENO, kMessage.data(), kMessage.size());
  ::_exit(EndProgram(interrupted_exit_code));
}

void EndByPipe(int signal) {
  RemoveTemporaryPaths();
  EndProgram(0);
  Install(signal, SIG_DFL);
  ::raise(signal);
}

}  // namespace

void HandleSignals(int exit_code) {
  interrupted_exit_code = exit_code;
  Install(SIGINT, Interrupt);
  Install(SIGTERM, Interrupt);
  if (!IsIgnored(SIGHUP)) Install(SIGHUP, Interrupt);
  if (!IsIgnored(SIGPIPE)) Install(SIGPIPE, EndByPipe);
  Install(SIGXFSZ, SIG_IGN);
}

void CatchInterrupts() { catching = !interrupted; }

bool IsInterrupted() { return interrupted; }

void EndOnInterrupts(int exit_code) {
  interrupted_exit_code = exit_code;
  catching = false;
}

HeldSignals::HeldSignals() {
  sigset_t held;
  ::sigemptyset(&held);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) ::sigaddset(&held, signal);
  ::sigprocmask(SIG_BLOCK, &held, &before_);
}

HeldSignals::~HeldSignals() { ::sigprocmask(SIG_SETMASK, &before_, nullptr); }

void LeaveInterruptsToParent() {
  Install(SIGINT, SIG_IGN);
  Install(SIGTERM, SIG_DFL);
  if (!IsIgnored(SIGHUP)) Install(SIGHUP, SIG_DFL);
  if (!IsIgnored(SIGPIPE)) Install(SIGPIPE, SIG_DFL);
}

}  // namespace dexcheck
