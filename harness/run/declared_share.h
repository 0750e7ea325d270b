#pragma once

// How much of a failed expectation comes of what the scenario declares.

#include <filesystem>
#include <functional>

#include "harness/run/runner.h"

namespace dexcheck {

/// When nothing but an expectation, or the error's own dynamics, fails in a scenario that declares
/// imperfections of the plant, repeats the run without them up to where the check was worst, at most for
/// 10 s. They are the cause where they explain half of the error or more, and the evidence says how much. A
/// scenario with a controller of the user's own is not repeated.
/// @param setup, loop, result of the run, which is judged. @param robot, mjcf its files. @param should_stop
/// asked before each step; what was stopped says nothing.
void WeighDeclared(const Setup& setup, const ClosedLoop& loop, const std::filesystem::path& robot,
                   const std::filesystem::path& mjcf, const std::function<bool()>& should_stop,
                   RunResult* result);

}  // namespace dexcheck
