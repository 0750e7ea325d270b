#pragma once

// Work in a process of its own: a crash there, or a limit that it runs into, costs nothing here.

#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace dexcheck {

/// How a process ended.
struct ProcessEnd {
  bool succeeded = false;  ///< By itself, with its work done.
  int signal = 0;          ///< That ended it; 0 for none.
  /// "Segmentation fault"; without a signal what to say instead.
  [[nodiscard]] std::string Describe(const std::string& without_signal) const;
};

/// A copy of this process that does one piece of work and ends. Interrupts from the terminal are left to this
/// process, and it ends when this one does, however it ends.
class WorkerProcess {
 public:
  /// @param what in the message: "WHAT cannot be started: reason".
  /// @param work is called in the new process, with its end of the channel; returns whether it succeeded. An
  ///   exception is no success.
  /// @throws Error when no process can be made.
  WorkerProcess(const std::string& what, const std::function<bool(int channel)>& work);
  /// Kills it, if it still runs.
  ~WorkerProcess();
  WorkerProcess(WorkerProcess&& other) noexcept;
  WorkerProcess& operator=(WorkerProcess&& other) noexcept;

  /// This process's end of the channel, a stream socket.
  [[nodiscard]] int channel() const { return channel_; }
  /// -1 once it has ended.
  [[nodiscard]] pid_t pid() const { return pid_; }
  void Kill() const;
  /// Waits until it has ended; to be called once.
  ProcessEnd Wait();

 private:
  void Release();

  pid_t pid_ = -1;
  int channel_ = -1;
};

/// Sends all bytes; false when the other side has ended.
bool Send(int channel, std::string_view bytes);

/// At most `size` bytes; none when the other side has ended.
std::string Receive(int channel, std::size_t size);

}  // namespace dexcheck
