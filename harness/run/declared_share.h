#pragma once

// The share of a failed expectation that comes from the scenario's declarations.

#include <filesystem>
#include <functional>

#include "harness/run/runner.h"

namespace dexcheck {

/// Repeats the run without the declared imperfections of the plant, up to the time of the check's worst
/// value, at most for 10 s, when nothing but an expectation, or the error's own dynamics, fails. The
/// imperfections are the cause where they explain half of the error or more, and the evidence says how much.
/// A scenario with a controller of the user's own is not repeated.
/// @param setup, loop, result of the run, which is judged. @param robot, mjcf its files. @param should_stop
/// asked before each step; a stopped repetition adds nothing.
void WeighDeclared(const Setup& setup, const ClosedLoop& loop, const std::filesystem::path& robot,
                   const std::filesystem::path& mjcf, const std::function<bool()>& should_stop,
                   RunResult* result);

}  // namespace dexcheck
