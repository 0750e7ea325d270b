#pragma once

// A user's program that replies to each line with a line.

#include <optional>
#include <string>

#include "controller/common/errors.h"
#include "harness/base/child_process.h"
#include "harness/descriptions/program_layout.h"

namespace dexcheck {

/// A program that ended, hangs, or writes something that is no result. One line that names its command.
class ProgramError : public Error {
 public:
  using Error::Error;
};

/// A command of the shell, from its start to the end of this object. It ends when its standard input does, or
/// is killed with all that it started.
class ProgramProcess {
 public:
  /// @param seconds within which each result must come.
  /// @throws ProgramError when no process can be made.
  ProgramProcess(std::string command, double seconds);
  /// Sends a line and returns the next line of standard output, without its end.
  /// @throws ProgramError when the program ends, hangs or writes without end, InputError when the shell
  /// knows no such command.
  std::string Query(const std::string& line);

  [[nodiscard]] const std::string& command() const { return command_; }

 private:
  void Write(const std::string& text, size_t* written);
  bool ReadOutput();
  void ReadMessages();
  /// @throws ProgramError "program "COMMAND": PROBLEM, its last words: ...".
  [[noreturn]] void Fail(const std::string& problem) const;
  [[noreturn]] void FailEnded();
  [[nodiscard]] std::string LastWords() const;

  std::string command_;
  double seconds_;
  std::optional<ChildProcess> child_;
  FileDescriptor input_;     // a socket: what cannot be written is an error, not a signal
  FileDescriptor output_;    // standard output
  FileDescriptor messages_;  // standard error
  std::string pending_;
  std::string said_;  // the end of standard error
  long results_ = 0;
};

// A program of the user's that computes terms at states: the protocol is in README.md.

/// Version of the protocol that this program speaks.
inline constexpr int kProgramProtocol = 1;

struct ProgramOptions {
  double seconds = 10.0;  ///< Within which each result must come.
};

/// A running program as a provider.
class ProgramProvider : public LayoutProvider {
 public:
  /// Starts it and says hello. @param robot outlives this.
  /// @throws ProgramError when it dies or hangs, InputError for what it writes that is no result; one line.
  ProgramProvider(const std::string& command, const RobotDescription& robot,
                  const ProgramOptions& options = {});

  /// The name that it gives itself, or its command.
  [[nodiscard]] const std::string& name() const override { return name_; }
  TermResults Evaluate(long sample, const VectorXd& q, const VectorXd& xi) override;

 private:
  nlohmann::json Query(const nlohmann::ordered_json& request);

  const RobotDescription& robot_;
  ProgramProcess process_;
  std::string source_;  // for messages
  std::string name_;
};

}  // namespace dexcheck
