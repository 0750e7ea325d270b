#pragma once

// Jobs in processes of their own, several at a time: one that crashes costs no other.

#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/common/errors.h"
#include "harness/base/child_process.h"

namespace dexcheck {

/// A job that has ended.
struct EndedJob {
  long number = 0;
  std::optional<std::string> result;  ///< None when its process ended without one.
  std::string failure;                ///< Then why: "the process died: Segmentation fault: ...".
  bool timed_out = false;             ///< It took more than the limit, and was ended.
  /// Its process was killed, by hand or by the system when memory is short: the job may be tried again.
  bool killed_from_outside = false;
};

/// Processes that each do one job at a time, begun when they are first needed. A process does one job after
/// another and keeps its memory between them. They end with the pool.
class ProcessPool {
 public:
  /// @param what in the message: "WHAT cannot be started: reason".
  /// @param run makes a job's result from its request; called in the job's process, a copy of this one.
  /// @param time_limit most processor time of a job, s; 0 for any.
  ProcessPool(std::string what, int size, double time_limit,
              std::function<std::string(const std::string& request)> run);

  [[nodiscard]] bool IsFull() const { return CountBusy() >= size_; }
  [[nodiscard]] bool IsEmpty() const { return CountBusy() == 0; }
  /// Numbers of the jobs that run now.
  [[nodiscard]] std::vector<long> ListRunning() const;

  /// Begins a job; the pool must not be full. @throws Error when no process can be made.
  void Start(long number, const std::string& request);

  /// Waits a little for a job to end; none when none did.
  std::optional<EndedJob> Wait();

 private:
  struct Worker {
    ChildProcess process;
    MessageFile messages;
    std::optional<long> job;  // that it does now
    std::string received;
    double begun = 0.0;  // its processor time when the job began, s
    bool timed_out = false;
  };
  [[nodiscard]] size_t CountBusy() const;
  bool Work(int channel, int messages) const;
  Worker MakeWorker() const;
  void EndSlowJobs();
  EndedJob Reap(size_t index);

  std::string what_;
  size_t size_;
  double time_limit_;
  std::function<std::string(const std::string&)> run_;
  std::vector<Worker> workers_;
};

/// How many jobs there are by default: one for each processor.
int CountProcessors();

/// Does jobs 0 to `count` - 1, `size` at a time, and calls `take` with each result, in the jobs' order.
/// @param run called in a job's process.
/// @param is_interrupted called often; once true, the jobs that run are ended.
/// @returns how many were taken: `count`, unless interrupted.
/// @throws InputError that a job threw; Error "WHAT: why" when a job's process ended without a result.
size_t RunJobs(const std::string& what, size_t count, int size,
               const std::function<std::string(size_t job)>& run,
               const std::function<void(size_t job, const std::string& result)>& take,
               const std::function<bool()>& is_interrupted);

// Values as bytes, between two processes of one program.

/// Numbers, enumerations, texts and lists of these, as MessagePack.
template <typename... Values>
std::string PackBytes(const Values&... values) {
  std::string bytes;
  nlohmann::json::to_msgpack(nlohmann::json::array({nlohmann::json(values)...}), bytes);
  return bytes;
}

/// Restores the values that PackBytes packed. @throws Error when the bytes are cut short.
template <typename... Values>
void UnpackBytes(std::string_view bytes, Values*... values) {
  try {
    const auto all = nlohmann::json::from_msgpack(bytes);
    size_t next = 0;
    (all.at(next++).get_to(*values), ...);
  } catch (const nlohmann::json::exception&) {
    throw Error("a message between two processes is cut short");
  }
}

}  // namespace dexcheck
