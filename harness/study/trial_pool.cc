#include "harness/study/trial_pool.h"

#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <limits>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"

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

std::vector<long> TrialPool::ListRunning() const {
  std::vector<long> trials;
  for (const Worker& worker : workers_) trials.push_back(worker.trial.number);
  return trials;
}

bool TrialPool::Work(const Trial& trial, int channel, int messages) const {
  ::dup2(messages, STDERR_FILENO);
  try {
    return Send(channel, Pack(run_(trial)));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "unknown error\n");
  }
  std::fflush(stderr);
  return false;
}

void TrialPool::Start(const Trial& trial) {
  FileDescriptor messages(::memfd_create("messages", MFD_CLOEXEC));
  if (!messages.is_open()) throw Error(std::string("a trial cannot be started: ") + std::strerror(errno));
  WorkerProcess process("a trial", [&](int channel) { return Work(trial, channel, messages.get()); });
  workers_.push_back({trial, std::move(process), std::move(messages), {}, false});
}

void TrialPool::EndSlowTrials() {
  if (time_limit_ <= 0.0) return;
  for (Worker& worker : workers_) {
    if (worker.timed_out || !(ReadProcessorTime(worker.process.pid()) > time_limit_)) continue;
    worker.timed_out = true;
    worker.process.Kill();
  }
}

std::optional<EndedTrial> TrialPool::Wait() {
  EndSlowTrials();
  std::vector<pollfd> files;
  for (const Worker& worker : workers_) files.push_back({worker.process.channel(), POLLIN, 0});
  if (::poll(files.data(), files.size(), kWait) <= 0) return std::nullopt;
  for (size_t i = 0; i < files.size(); ++i) {
    if (files[i].revents == 0) continue;
    constexpr size_t kChunk = 4096;
    const std::string bytes = Receive(workers_[i].process.channel(), kChunk);
    if (bytes.empty()) return Finish(i);
    workers_[i].received += bytes;
  }
  return std::nullopt;
}

EndedTrial TrialPool::Finish(size_t index) {
  Worker worker = std::move(workers_[index]);
  workers_.erase(workers_.begin() + static_cast<std::ptrdiff_t>(index));
  const ProcessEnd end = worker.process.Wait();
  const std::string message = ReadLastLine(worker.messages.get());
  EndedTrial ended;
  ended.row.trial = worker.trial;
  if (const auto result = Unpack(worker.received); result && end.succeeded) {
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
  ended.killed_from_outside = end.signal == SIGKILL || end.signal == SIGTERM || end.signal == SIGHUP;
  const std::string how = end.Describe(message.empty() ? "" : Abbreviate(message));
  result.failure = ended.killed_from_outside ? "the process was killed from outside: " + how
                   : end.signal != 0         ? "the process died: " + how
                   : how.empty()             ? "the process ended without a result"
                                             : how;
  return ended;
}

}  // namespace dexcheck
