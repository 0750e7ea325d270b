#include "harness/base/interrupts.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <string_view>

#include "controller/common/errors.h"
#include "harness/base/child_process.h"
#include "harness/base/console.h"
#include "harness/base/files.h"

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

namespace {

pid_t program = -1;  // of main, which may be watched
int failure_exit_code = EXIT_FAILURE;
std::atomic<int> announcement = -1;  // the copy's end of a pipe
std::atomic<pid_t> copy = -1;        // which goes on

/// A terminal's signal reaches the whole group.
void PassOn(int signal, siginfo_t* info, void* /*context*/) {
  if (info->si_code != SI_KERNEL) ::kill(copy, signal);
}

[[noreturn]] void Watch(const std::string& what, int end) {
  struct sigaction action {};
  action.sa_sigaction = PassOn;
  action.sa_flags = SA_SIGINFO | SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::sigaction(signal, &action, nullptr);
  int status = 0;
  while (::waitpid(copy, &status, 0) < 0 && errno == EINTR) {
  }
  char byte = 0;
  const bool is_announced = ::read(end, &byte, 1) == 1;
  const ProcessEnd how{WIFEXITED(status) ? WEXITSTATUS(status) : EXIT_FAILURE,
                       WIFSIGNALED(status) ? WTERMSIG(status) : 0};
  if (is_announced && how.signal != 0) {
    ::signal(how.signal, SIG_DFL);
    ::raise(how.signal);
  }
  if (is_announced) ::_exit(how.exit_code);
  RemoveTemporaryPaths();
  Warn(what + " ended the program (" + how.Describe("exit code " + std::to_string(how.exit_code)) + ")");
  ::_exit(failure_exit_code);
}

}  // namespace

void AllowWatching(int failure) {
  program = ::getpid();
  failure_exit_code = failure;
}

void ContinueWatched(const std::string& what) {
  std::error_code error;
  const std::filesystem::directory_iterator threads("/proc/self/task", error);
  if (program != ::getpid() || error || std::distance(begin(threads), end(threads)) != 1) return;
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw Error(what + " cannot be started: " + std::strerror(errno));
  std::fflush(nullptr);  // or both would write it
  const pid_t pid = ::fork();
  if (pid < 0) throw Error(what + " cannot be started: " + std::strerror(errno));
  if (pid > 0) {
    copy = pid;
    ::close(ends[1]);
    Watch(what, ends[0]);
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != program) ::_exit(failure_exit_code);  // it ended before
  ::close(ends[0]);
  copy = ::getpid();
  announcement = ends[1];
}

int EndProgram(int exit_code) {
  if (copy != ::getpid()) return exit_code;  // a worker of the copy ends
  const int end = announcement.exchange(-1);
  if (end >= 0) [[maybe_unused]]
    const ssize_t ignored = ::write(end, "e", 1);
  return exit_code;
}

void FailAtOnce(const std::string& what) {
  RemoveTemporaryPaths();
  for (const std::string_view text :
       {std::string_view("dexcheck: "), std::string_view(what), std::string_view("\n")}) {
    [[maybe_unused]] const ssize_t ignored = ::write(STDERR_FILENO, text.data(), text.size());
  }
  ::_exit(EndProgram(failure_exit_code));
}

}  // namespace dexcheck
