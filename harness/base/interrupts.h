#pragma once

// Signals: Ctrl-C ends the program without leaving anything half done, and a full quota is an ordinary error.

#include <csignal>
#include <string>

namespace dexcheck {

/// To be called first thing in main. SIGINT, SIGTERM and SIGHUP (unless it is ignored, as under nohup) end
/// the program at once: temporary files go, one line says so, and the exit code is `exit_code`. SIGPIPE ends
/// it as it does without a handler, but temporary files go first. A file that grows beyond the limit of the
/// shell (SIGXFSZ) is a failure to write.
void HandleSignals(int exit_code);

/// From now on the first signal only sets a flag; the next ends the program as before.
void CatchInterrupts();
/// Whether there was one since.
bool IsInterrupted();
/// From now on a signal ends the program at once again, with this exit code.
void EndOnInterrupts(int exit_code);

/// While it lives, signals that end the program wait: between making a file or folder and protecting it.
class HeldSignals {
 public:
  HeldSignals();
  ~HeldSignals();
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;

 private:
  sigset_t before_ = {};
};

/// For a forked process that works for this one: Ctrl-C reaches the whole group and the parent decides, other
/// signals end it at once.
void LeaveInterruptsToParent();

// A program that runs a user's code: whatever that code does to the process, somebody is left to say so.

/// To be called in main. @param failure exit code of a program that somebody else's code has ended.
void AllowWatching(int failure);

/// Goes on in a copy of this process, while this one waits for it and passes on its end. An end that the copy
/// did not announce by EndProgram is reported in one line, "WHAT ended the program (exit code 0)", and is a
/// failure. Signals that are sent to this process reach the copy. Does nothing where main has not allowed it,
/// in a copy, in a forked worker, and where there are other threads, which a copy would not have.
/// @param what "controller law.so". @throws Error when no process can be made.
void ContinueWatched(const std::string& what);

/// Announces that the process ends by itself. Safe in a handler of signals. @returns the exit code.
int EndProgram(int exit_code);

/// Ends this process with a line on standard error and the exit code of AllowWatching. Temporary files go
/// before. Safe in a handler of signals.
[[noreturn]] void FailAtOnce(const std::string& what);

}  // namespace dexcheck
