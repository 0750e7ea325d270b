#include "harness/base/child_process.h"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
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
  } catch (...) {  // who wants to report it catches it
  }
  ::_exit(succeeded ? EXIT_SUCCESS : EXIT_FAILURE);
}

/// In the child. Only calls that are safe after a fork.
[[noreturn]] void RunProgram(const Program& program, const std::vector<char*>& words, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(EXIT_FAILURE);  // it ended before
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ}) ::signal(signal, SIG_DFL);
  const bool is_ready = ::dup2(program.input, STDIN_FILENO) >= 0 &&
                        ::dup2(program.output, STDOUT_FILENO) >= 0 &&
                        ::dup2(program.errors, STDERR_FILENO) >= 0 &&
                        (program.folder.empty() || ::chdir(program.folder.c_str()) == 0);
  if (is_ready) ::execvp(words.front(), words.data());
  ::_exit(kNotFoundExitCode);
}

ProcessEnd ReadEnd(int status) {
  if (WIFSIGNALED(status)) return {EXIT_FAILURE, WTERMSIG(status)};
  return {WEXITSTATUS(status), 0};
}

}  // namespace

std::string FindProgram(const std::string& name) {
  const std::filesystem::path installed = FindInstalled("libexec/dexcheck/" + name);
  return ::access(installed.c_str(), X_OK) == 0 ? installed.string() : name;
}

MessageFile::MessageFile() : file_(::memfd_create("messages", MFD_CLOEXEC)) {
  if (!file_.is_open()) FailToStart("a process", errno);
}

std::string MessageFile::ReadLastLine() const {
  constexpr off_t kMost = 4096;
  const off_t size = ::lseek(descriptor(), 0, SEEK_END);
  if (size <= 0) return "";
  std::string text(static_cast<size_t>(std::min(size, kMost)), '\0');
  const ssize_t count =
      ::pread(descriptor(), text.data(), text.size(), size - static_cast<off_t>(text.size()));
  text.resize(static_cast<size_t>(std::max<ssize_t>(count, 0)));
  while (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

std::string ProcessEnd::Describe(const std::string& without_signal) const {
  return signal != 0 ? ::strsignal(signal) : without_signal;
}

std::string ProcessEnd::Describe() const {
  constexpr int kNotFound = 127;  // of a shell
  return signal != 0 ? "was killed by signal " + std::to_string(signal)
                     : "ended with exit code " + std::to_string(exit_code) +
                           (exit_code == kNotFound ? " (no such command)" : "");
}

ChildProcess::ChildProcess(const std::string& what, const std::function<bool(int channel)>& work) {
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
  channel_ = FileDescriptor(ends[0]);
  if (pid_ < 0) FailToStart(what, error);
}

ChildProcess::ChildProcess(const std::string& what, const Program& program) : is_group_(true) {
  std::vector<char*> words;
  for (const std::string& word : program.words) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) RunProgram(program, words, parent);
  if (pid_ < 0) FailToStart(what, errno);
  ::setpgid(pid_, pid_);  // whoever is first
}

ChildProcess::~ChildProcess() { Release(); }

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), channel_(std::move(other.channel_)), is_group_(other.is_group_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  if (this == &other) return *this;
  Release();
  pid_ = std::exchange(other.pid_, -1);
  channel_ = std::move(other.channel_);
  is_group_ = other.is_group_;
  return *this;
}

void ChildProcess::Release() {
  if (pid_ < 0) return;
  Kill();
  Wait();
}

void ChildProcess::Kill() const { ::kill(is_group_ ? -pid_ : pid_, SIGKILL); }

ProcessEnd ChildProcess::Wait() {
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  return ReadEnd(status);
}

std::optional<ProcessEnd> ChildProcess::WaitFor(double seconds) {
  constexpr double kPause = 0.005;  // s
  for (double waited = 0.0; pid_ >= 0; waited += kPause) {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_) {
      pid_ = -1;
      return ReadEnd(status);
    }
    if (waited >= seconds) break;
    ::usleep(static_cast<useconds_t>(1e6 * kPause));
  }
  return std::nullopt;
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
