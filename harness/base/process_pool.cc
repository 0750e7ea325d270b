#include "harness/base/process_pool.h"

#include <malloc.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <ctime>
#include <limits>
#include <map>
#include <thread>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

constexpr int kWait = 100;  // ms
constexpr size_t kChunk = 1 << 16;

/// A message is its length and its bytes.
bool SendMessage(int channel, const std::string& bytes) {
  const size_t length = bytes.size();
  return Send(channel, std::string(reinterpret_cast<const char*>(&length), sizeof length) + bytes);
}

/// @returns a whole message from the front of what was received; none while it is not whole.
std::optional<std::string> TakeMessage(std::string* received) {
  size_t length = 0;
  if (received->size() < sizeof length) return std::nullopt;
  std::memcpy(&length, received->data(), sizeof length);
  if (received->size() < sizeof length + length) return std::nullopt;
  std::string message = received->substr(sizeof length, length);
  received->erase(0, sizeof length + length);
  return message;
}

/// Processor time of a process and its threads so far, s; 0 when the process does not exist.
double ReadProcessorTime(pid_t pid) {
  clockid_t clock = 0;
  timespec time{};
  if (::clock_getcpuclockid(pid, &clock) != 0 || ::clock_gettime(clock, &time) != 0) return 0.0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

ProcessPool::ProcessPool(std::string what, int size, double time_limit,
                         std::function<std::string(const std::string&)> run)
    : what_(std::move(what)),
      size_(static_cast<size_t>(size)),
      time_limit_(time_limit),
      run_(std::move(run)) {}

size_t ProcessPool::CountBusy() const { return ListRunning().size(); }

std::vector<long> ProcessPool::ListRunning() const {
  std::vector<long> jobs;
  for (const Worker& worker : workers_) {
    if (worker.job) jobs.push_back(*worker.job);
  }
  return jobs;
}

bool ProcessPool::Work(int channel, int messages) const {
  // A job's large blocks come from the heap and stay there for the next one: fresh pages from the system
  // cost more than a short job.
  constexpr int kLargest = 32 << 20;
  ::mallopt(M_MMAP_THRESHOLD, kLargest);
  ::mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  ::dup2(messages, STDERR_FILENO);
  std::string received;
  try {
    while (true) {
      const std::string bytes = Receive(channel, kChunk);
      if (bytes.empty()) return true;  // no more jobs
      received += bytes;
      const auto request = TakeMessage(&received);
      if (!request) continue;
      std::fflush(stderr);
      // Messages of an earlier job are cleared; a failure to do so only affects messages.
      if (::ftruncate(messages, 0) == 0) ::lseek(messages, 0, SEEK_SET);
      if (!SendMessage(channel, run_(*request))) return false;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "unknown error\n");
  }
  std::fflush(stderr);
  return false;
}

ProcessPool::Worker ProcessPool::MakeWorker() const {
  MessageFile messages;
  // It holds no other worker's channel: each would keep the others alive.
  ChildProcess process(what_, [&](int channel) {
    for (const Worker& other : workers_) ::close(other.process.channel());
    return Work(channel, messages.descriptor());
  });
  return {std::move(process), std::move(messages), std::nullopt, {}, 0.0, false};
}

void ProcessPool::Start(long number, const std::string& request) {
  while (true) {
    auto idle = std::ranges::find_if(workers_, [](const Worker& worker) { return !worker.job; });
    if (idle == workers_.end()) {
      workers_.push_back(MakeWorker());
      idle = workers_.end() - 1;
    }
    if (!SendMessage(idle->process.channel(), request)) {
      workers_.erase(idle);  // it was killed while it had nothing to do
      continue;
    }
    idle->begun = ReadProcessorTime(idle->process.pid());
    idle->job = number;
    return;
  }
}

void ProcessPool::EndSlowJobs() {
  if (time_limit_ <= 0.0) return;
  for (Worker& worker : workers_) {
    if (!worker.job || worker.timed_out) continue;
    if (!(ReadProcessorTime(worker.process.pid()) - worker.begun > time_limit_)) continue;
    worker.timed_out = true;
    worker.process.Kill();
  }
}

std::optional<EndedJob> ProcessPool::Wait() {
  EndSlowJobs();
  std::vector<pollfd> files;
  std::vector<size_t> busy;
  for (size_t i = 0; i < workers_.size(); ++i) {
    if (!workers_[i].job) continue;
    files.push_back({workers_[i].process.channel(), POLLIN, 0});
    busy.push_back(i);
  }
  if (::poll(files.data(), files.size(), kWait) <= 0) return std::nullopt;
  for (size_t i = 0; i < files.size(); ++i) {
    if (files[i].revents == 0) continue;
    Worker& worker = workers_[busy[i]];
    const std::string bytes = Receive(worker.process.channel(), kChunk);
    if (bytes.empty()) return Reap(busy[i]);
    worker.received += bytes;
    auto result = TakeMessage(&worker.received);
    if (!result) continue;
    EndedJob ended{.number = *worker.job, .result = std::move(result), .failure = {}};
    worker.job.reset();
    return ended;
  }
  return std::nullopt;
}

EndedJob ProcessPool::Reap(size_t index) {
  Worker worker = std::move(workers_[index]);
  workers_.erase(workers_.begin() + static_cast<std::ptrdiff_t>(index));
  const ProcessEnd end = worker.process.Wait();
  const std::string message = worker.messages.ReadLastLine();
  EndedJob ended{.number = *worker.job, .result = std::nullopt, .failure = {}};
  ended.timed_out = worker.timed_out;
  ended.killed_from_outside =
      !worker.timed_out && (end.signal == SIGKILL || end.signal == SIGTERM || end.signal == SIGHUP);
  const std::string how = end.Describe(message.empty() ? "" : Abbreviate(message));
  ended.failure = ended.killed_from_outside ? "the process was killed from outside: " + how
                  : end.signal != 0         ? "the process died: " + how
                  : how.empty()             ? "the process ended without a result"
                                            : how;
  return ended;
}

int CountProcessors() { return static_cast<int>(std::max(std::thread::hardware_concurrency(), 1U)); }

size_t RunJobs(const std::string& what, size_t count, int size,
               const std::function<std::string(size_t job)>& run,
               const std::function<void(size_t job, const std::string& result)>& take,
               const std::function<bool()>& is_interrupted) {
  ProcessPool pool(what, size, /*time_limit=*/0.0, [&](const std::string& request) {
    size_t job = 0;
    UnpackBytes(request, &job);
    try {
      return "+" + run(job);
    } catch (const InputError& error) {
      return std::string("-") + error.what();
    }
  });
  std::map<size_t, std::string> early;  // results of jobs behind one that is not done
  size_t begun = 0, taken = 0;
  while (taken < count && !is_interrupted()) {
    for (; begun < count && !pool.IsFull(); ++begun) pool.Start(static_cast<long>(begun), PackBytes(begun));
    auto ended = pool.Wait();
    if (!ended) continue;
    if (!ended->result) throw Error(what + ": " + ended->failure);
    early.emplace(ended->number, std::move(*ended->result));
    for (auto next = early.find(taken); next != early.end() && !is_interrupted();
         next = early.find(++taken)) {
      const bool is_done = next->second.starts_with('+');
      const std::string result = next->second.substr(1);
      early.erase(next);
      if (!is_done) throw InputError(result);
      take(taken, result);
    }
  }
  return taken;
}

}  // namespace dexcheck
