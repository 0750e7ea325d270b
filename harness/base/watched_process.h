#pragma once

// A program that runs a user's code: whatever that code does to the process, somebody is left to say so.

#include <string>

namespace dexcheck {

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
