#include "harness/study/trial_pool.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <limits>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/interrupts.h"

namespace dexcheck {
namespace {

constexpr int kWait = 100;  // ms
constexpr size_t kFixedBytes = 1 + sizeof(double) * kNumMetrics;

/// Outcome, metrics, failure, as bytes between two processes of one program.
std::string Pack(const TrialResult& result) {
  std::string bytes(kFixedBytes, '\0');
  bytes[0] = static_cast<char>(result.outcome);
  std::memcpy(bytes.data() + 1, result.metrics.data(), sizeof(double) * kNumMetrics);
  return bytes + result.failure;
}

std::optional<TrialResult> Unpack(const std::string& bytes) {
  if (bytes.size() < kFixedBytes) return std::nullopt;
  TrialResult result;
  result.outcome = static_cast<Outcome>(bytes[0]);
  std::memcpy(result.metrics.data(), bytes.data() + 1, sizeof(double) * kNumMetrics);
  result.failure = bytes.substr(kFixedBytes);
  return result;
}

bool WriteAll(int file, const std::string& bytes) {
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::write(file, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno != EINTR) return false;
    if (count > 0) done += static_cast<size_t>(count);
  }
  return true;
}

/// The last line of what a process wrote.
std::string ReadLastLine(int file) {
  constexpr off_t kMost = 4096;
  const off_t size = ::lseek(file, 0, SEEK_END);
  if (size <= 0) return "";
  std::string text(static_cast<size_t>(std::min(size, kMost)), '\0');
  const ssize_t count = ::pread(file, text.data(), text.size(), size - static_cast<off_t>(text.size()));
  if (count <= 0) return "";
  text.resize(static_cast<size_t>(count));
  while (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

/// Of a process and its threads so far, s; 0 when there is none.
double ReadProcessorTime(pid_t pid) {
  clockid_t clock = 0;
  timespec time{};
  if (::clock_getcpuclockid(pid, &clock) != 0 || ::clock_gettime(clock, &time) != 0) return 0.0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

TrialPool::TrialPool(int size, double time_limit, std::function<TrialResult(const Trial&)> run)
    : size_(static_cast<size_t>(size)), time_limit_(time_limit), run_(std::move(run)) {}

TrialPool::~TrialPool() {
  for (const Worker& worker : workers_) {
    ::kill(worker.pid, SIGKILL);
    ::waitpid(worker.pid, nullptr, 0);
    ::close(worker.results);
    ::close(worker.messages);
  }
}

std::vector<long> TrialPool::ListRunning() const {
  std::vector<long> trials;
  for (const Worker& worker : workers_) trials.push_back(worker.trial.number);
  return trials;
}

void TrialPool::Work(const Trial& trial, int results, int messages, pid_t parent) const {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(EXIT_FAILURE);
  LeaveInterruptsToParent();
  ::dup2(messages, STDERR_FILENO);
  try {
    ::_exit(WriteAll(results, Pack(run_(trial))) ? EXIT_SUCCESS : EXIT_FAILURE);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "unknown error\n");
  }
  std::fflush(stderr);
  ::_exit(EXIT_FAILURE);
}

void TrialPool::Start(const Trial& trial) {
  const auto fail = [] { throw Error(std::string("a trial cannot be started: ") + std::strerror(errno)); };
  Worker worker;
  worker.trial = trial;
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) fail();
  worker.results = ends[0];
  worker.messages = ::memfd_create("messages", MFD_CLOEXEC);
  const pid_t parent = ::getpid();
  worker.pid = worker.messages < 0 ? -1 : ::fork();
  if (worker.pid < 0) {
    ::close(ends[0]);
    ::close(ends[1]);
    fail();
  }
  if (worker.pid == 0) Work(trial, ends[1], worker.messages, parent);
  ::close(ends[1]);
  workers_.push_back(std::move(worker));
}

void TrialPool::EndSlowTrials() {
  if (time_limit_ <= 0.0) return;
  for (Worker& worker : workers_) {
    if (worker.timed_out || !(ReadProcessorTime(worker.pid) > time_limit_)) continue;
    worker.timed_out = true;
    ::kill(worker.pid, SIGKILL);
  }
}

std::optional<EndedTrial> TrialPool::Wait() {
  EndSlowTrials();
  std::vector<pollfd> files;
  for (const Worker& worker : workers_) files.push_back({worker.results, POLLIN, 0});
  if (::poll(files.data(), files.size(), kWait) <= 0) return std::nullopt;
  for (size_t i = 0; i < files.size(); ++i) {
    if (files[i].revents == 0) continue;
    char buffer[4096];
    const ssize_t count = ::read(workers_[i].results, buffer, sizeof(buffer));
    if (count > 0) workers_[i].received.append(buffer, static_cast<size_t>(count));
    if (count == 0) return Finish(i);
  }
  return std::nullopt;
}

EndedTrial TrialPool::Finish(size_t index) {
  const Worker worker = std::move(workers_[index]);
  workers_.erase(workers_.begin() + static_cast<std::ptrdiff_t>(index));
  int status = 0;
  ::waitpid(worker.pid, &status, 0);
  const std::string message = ReadLastLine(worker.messages);
  ::close(worker.results);
  ::close(worker.messages);
  EndedTrial ended;
  ended.row.trial = worker.trial;
  const bool succeeded = WIFEXITED(status) && WEXITSTATUS(status) == EXIT_SUCCESS;
  if (const auto result = Unpack(worker.received); result && succeeded) {
    ended.row.result = *result;
    return ended;
  }
  TrialResult& result = ended.row.result;
  result.outcome = worker.timed_out ? Outcome::kTimedOut : Outcome::kCrashed;
  result.metrics.fill(std::numeric_limits<double>::quiet_NaN());
  if (worker.timed_out) {
    result.failure =
        "it took more than trial_time_limit, " + FormatNumber(time_limit_) + " s of processor time";
    return ended;
  }
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  ended.killed_from_outside = signal == SIGKILL || signal == SIGTERM || signal == SIGHUP;
  result.failure = ended.killed_from_outside
                       ? std::string("the process was killed from outside: ") + ::strsignal(signal)
                   : signal != 0     ? std::string("the process died: ") + ::strsignal(signal)
                   : message.empty() ? "the process ended without a result"
                                     : Abbreviate(message);
  return ended;
}

}  // namespace dexcheck
