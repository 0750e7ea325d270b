#include "harness/study/trial_pool.h"

#include <malloc.h>
#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
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

/// Seed, number and parameters of a trial, likewise.
std::string Pack(const Trial& trial) {
  std::string bytes(2 * sizeof(std::int64_t) + sizeof(double) * trial.parameters.size(), '\0');
  const auto number = static_cast<std::int64_t>(trial.number);
  std::memcpy(bytes.data(), &number, sizeof number);
  std::memcpy(bytes.data() + sizeof number, &trial.seed, sizeof trial.seed);
  std::memcpy(bytes.data() + 2 * sizeof number, trial.parameters.data(),
              sizeof(double) * trial.parameters.size());
  return bytes;
}

Trial UnpackTrial(const std::string& bytes) {
  Trial trial;
  std::int64_t number = 0;
  std::memcpy(&number, bytes.data(), sizeof number);
  trial.number = static_cast<long>(number);
  std::memcpy(&trial.seed, bytes.data() + sizeof number, sizeof trial.seed);
  trial.parameters.resize((bytes.size() - 2 * sizeof number) / sizeof(double));
  std::memcpy(trial.parameters.data(), bytes.data() + 2 * sizeof number,
              sizeof(double) * trial.parameters.size());
  return trial;
}

constexpr size_t kLengthBytes = sizeof(std::uint64_t);

/// A message is its length and its bytes.
bool SendMessage(int channel, const std::string& bytes) {
  const std::uint64_t length = bytes.size();
  std::string head(kLengthBytes, '\0');
  std::memcpy(head.data(), &length, kLengthBytes);
  return Send(channel, head + bytes);
}

/// Takes a whole message from the front of what was received; none while it is not whole.
std::optional<std::string> TakeMessage(std::string* received) {
  if (received->size() < kLengthBytes) return std::nullopt;
  std::uint64_t length = 0;
  std::memcpy(&length, received->data(), kLengthBytes);
  if (received->size() < kLengthBytes + length) return std::nullopt;
  std::string message = received->substr(kLengthBytes, length);
  received->erase(0, kLengthBytes + length);
  return message;
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

size_t TrialPool::CountBusy() const {
  return static_cast<size_t>(std::count_if(workers_.begin(), workers_.end(),
                                           [](const Worker& worker) { return worker.trial.has_value(); }));
}

std::vector<long> TrialPool::ListRunning() const {
  std::vector<long> trials;
  for (const Worker& worker : workers_) {
    if (worker.trial) trials.push_back(worker.trial->number);
  }
  return trials;
}

bool TrialPool::Work(int channel, int messages) const {
  // A trial's large blocks come from the heap and stay there for the next one: fresh pages from the system
  // cost more than a short trial.
  constexpr int kLargest = 32 << 20;
  ::mallopt(M_MMAP_THRESHOLD, kLargest);
  ::mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  ::dup2(messages, STDERR_FILENO);
  std::string received;
  try {
    while (true) {
      constexpr size_t kChunk = 4096;
      const std::string bytes = Receive(channel, kChunk);
      if (bytes.empty()) return true;  // no more trials
      received += bytes;
      const auto request = TakeMessage(&received);
      if (!request) continue;
      std::fflush(stderr);
      // What an earlier trial said is not this one's; should it stay, it is only a message.
      if (::ftruncate(messages, 0) == 0) ::lseek(messages, 0, SEEK_SET);
      if (!SendMessage(channel, Pack(run_(UnpackTrial(*request))))) return false;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "unknown error\n");
  }
  std::fflush(stderr);
  return false;
}

TrialPool::Worker TrialPool::MakeWorker() const {
  FileDescriptor messages(::memfd_create("messages", MFD_CLOEXEC));
  if (!messages.is_open()) throw Error(std::string("a trial cannot be started: ") + std::strerror(errno));
  // It holds no other worker's channel: each would keep the others alive.
  ChildProcess process("a trial", [&](int channel) {
    for (const Worker& other : workers_) ::close(other.process.channel());
    return Work(channel, messages.get());
  });
  return {std::move(process), std::move(messages), std::nullopt, {}, 0.0, false};
}

void TrialPool::Start(const Trial& trial) {
  const std::string request = Pack(trial);
  while (true) {
    auto idle =
        std::find_if(workers_.begin(), workers_.end(), [](const Worker& worker) { return !worker.trial; });
    if (idle == workers_.end()) {
      workers_.push_back(MakeWorker());
      idle = workers_.end() - 1;
    }
    if (!SendMessage(idle->process.channel(), request)) {
      workers_.erase(idle);  // it was killed while it had nothing to do
      continue;
    }
    idle->begun = ReadProcessorTime(idle->process.pid());
    idle->trial = trial;
    return;
  }
}

void TrialPool::EndSlowTrials() {
  if (time_limit_ <= 0.0) return;
  for (Worker& worker : workers_) {
    if (!worker.trial || worker.timed_out) continue;
    if (!(ReadProcessorTime(worker.process.pid()) - worker.begun > time_limit_)) continue;
    worker.timed_out = true;
    worker.process.Kill();
  }
}

std::optional<EndedTrial> TrialPool::TakeResult(Worker* worker) const {
  const auto message = TakeMessage(&worker->received);
  const auto result = message ? Unpack(*message) : std::nullopt;
  if (!result) return std::nullopt;
  EndedTrial ended;
  ended.row.trial = *worker->trial;
  ended.row.result = *result;
  worker->trial.reset();
  return ended;
}

std::optional<EndedTrial> TrialPool::Wait() {
  EndSlowTrials();
  std::vector<pollfd> files;
  std::vector<size_t> busy;
  for (size_t i = 0; i < workers_.size(); ++i) {
    if (!workers_[i].trial) continue;
    files.push_back({workers_[i].process.channel(), POLLIN, 0});
    busy.push_back(i);
  }
  if (::poll(files.data(), files.size(), kWait) <= 0) return std::nullopt;
  for (size_t i = 0; i < files.size(); ++i) {
    if (files[i].revents == 0) continue;
    constexpr size_t kChunk = 4096;
    Worker& worker = workers_[busy[i]];
    const std::string bytes = Receive(worker.process.channel(), kChunk);
    if (bytes.empty()) return Bury(busy[i]);
    worker.received += bytes;
    if (auto ended = TakeResult(&worker)) return ended;
  }
  return std::nullopt;
}

EndedTrial TrialPool::Bury(size_t index) {
  Worker worker = std::move(workers_[index]);
  workers_.erase(workers_.begin() + static_cast<std::ptrdiff_t>(index));
  const ProcessEnd end = worker.process.Wait();
  const std::string message = ReadLastLine(worker.messages.get());
  EndedTrial ended;
  ended.row.trial = *worker.trial;
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
