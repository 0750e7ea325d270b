#include "harness/base/worker_process.h"

#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "controller/common/errors.h"
#include "harness/base/interrupts.h"

namespace dexcheck {
namespace {

[[noreturn]] void FailToStart(const std::string& what, int error) {
  throw Error(what + " cannot be started: " + std::strerror(error));
}

[[noreturn]] void RunWork(const std::function<bool(int)>& work, int channel, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(EXIT_FAILURE);  // it ended before
  LeaveInterruptsToParent();
  bool succeeded = false;
  try {
    succeeded = work(channel);
  } catch (...) {  // who wants to tell of it catches it
  }
  ::_exit(succeeded ? EXIT_SUCCESS : EXIT_FAILURE);
}

}  // namespace

std::string ProcessEnd::Describe(const std::string& without_signal) const {
  return signal != 0 ? ::strsignal(signal) : without_signal;
}

WorkerProcess::WorkerProcess(const std::string& what, const std::function<bool(int channel)>& work) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) FailToStart(what, errno);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) {
    ::close(ends[0]);
    RunWork(work, ends[1], parent);
  }
  const int error = errno;
  ::close(ends[1]);
  channel_ = ends[0];
  if (pid_ >= 0) return;
  ::close(channel_);
  FailToStart(what, error);
}

WorkerProcess::~WorkerProcess() { Release(); }

WorkerProcess::WorkerProcess(WorkerProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), channel_(std::exchange(other.channel_, -1)) {}

WorkerProcess& WorkerProcess::operator=(WorkerProcess&& other) noexcept {
  if (this == &other) return *this;
  Release();
  pid_ = std::exchange(other.pid_, -1);
  channel_ = std::exchange(other.channel_, -1);
  return *this;
}

void WorkerProcess::Release() {
  if (pid_ >= 0) {
    Kill();
    Wait();
  }
  if (channel_ >= 0) ::close(channel_);
}

void WorkerProcess::Kill() const { ::kill(pid_, SIGKILL); }

ProcessEnd WorkerProcess::Wait() {
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  return {WIFEXITED(status) && WEXITSTATUS(status) == EXIT_SUCCESS,
          WIFSIGNALED(status) ? WTERMSIG(status) : 0};
}

bool Send(int channel, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(channel, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count < 0 && errno != EINTR) return false;
    if (count > 0) bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

std::string Receive(int channel, std::size_t size) {
  std::string bytes(size, '\0');
  ssize_t count = 0;
  do {
    count = ::recv(channel, bytes.data(), size, 0);
  } while (count < 0 && errno == EINTR);
  bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  return bytes;
}

}  // namespace dexcheck
