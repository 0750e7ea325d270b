#pragma once

// Work in a process of its own, a copy of this one or another program: a crash there, or a limit that it runs
// into, costs nothing here.

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/base/files.h"

namespace dexcheck {

/// How a process ended.
struct ProcessEnd {
  int exit_code = EXIT_SUCCESS;
  int signal = 0;  ///< That ended it; 0 for none.
  /// By itself, with its work done.
  [[nodiscard]] bool has_succeeded() const { return exit_code == EXIT_SUCCESS && signal == 0; }
  /// "Segmentation fault"; without a signal what to say instead.
  [[nodiscard]] std::string Describe(const std::string& without_signal) const;
  /// "was killed by signal 11", "ended with exit code 4".
  [[nodiscard]] std::string Describe() const;
};

/// Another program to be run.
struct Program {
  std::vector<std::string> words;  ///< Its name, looked for as a shell does, and its arguments.
  int input = 0;                   ///< Descriptors of this process that are its first three.
  int output = 1;
  int errors = 2;
  std::filesystem::path folder = {};  ///< That it works in; this process's when empty.
};

/// Exit code of a program that cannot be run, and of a shell whose command does not exist.
inline constexpr int kNotFoundExitCode = 127;

/// The program of this name that is installed with this one, in libexec/dexcheck; the name alone where there
/// is none.
std::string FindProgram(const std::string& name);

/// File in memory that collects a process's standard error.
class MessageFile {
 public:
  /// @throws Error when there is no memory for it.
  MessageFile();
  [[nodiscard]] int descriptor() const { return file_.get(); }
  /// Without its end; empty when nothing was written.
  [[nodiscard]] std::string ReadLastLine() const;

 private:
  FileDescriptor file_;
};

/// A process that does one piece of work and ends. Interrupts from the terminal are left to this process, and
/// it ends when this one does, however it ends.
class ChildProcess {
 public:
  /// @param what in the message: "WHAT cannot be started: reason".
  /// @param work is called in the new process, with its end of the channel; returns whether it succeeded. An
  ///   exception is no success.
  /// @throws Error when no process can be made.
  ChildProcess(const std::string& what, const std::function<bool(int channel)>& work);
  /// Runs a program in a process group of its own; it has no channel. One that cannot be run ends at once
  /// with kNotFoundExitCode.
  ChildProcess(const std::string& what, const Program& program);
  /// Kills it, if it still runs, a program with all that it has started.
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  /// This process's end of the channel, a stream socket.
  [[nodiscard]] int channel() const { return channel_.get(); }
  /// -1 once it has ended.
  [[nodiscard]] pid_t pid() const { return pid_; }
  void Kill() const;
  /// Waits until it has ended; to be called once.
  ProcessEnd Wait();
  /// Waits so many seconds at most; none when it still runs, or when its end is known already.
  std::optional<ProcessEnd> WaitFor(double seconds);

 private:
  void Release();

  pid_t pid_ = -1;
  FileDescriptor channel_;
  bool is_group_ = false;
};

/// Sends all bytes; false when the other process has ended.
bool Send(int channel, std::string_view bytes);

/// At most `size` bytes; none when the other process has ended.
std::string Receive(int channel, std::size_t size);

}  // namespace dexcheck
