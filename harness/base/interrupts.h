#pragma once

// Signals: Ctrl-C ends the program without leaving anything half done, and a full quota is an ordinary error.

#include <csignal>

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

}  // namespace dexcheck
