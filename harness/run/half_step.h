#pragma once

// Is it time stepping, or what the scenario declares? The same interval again at half the step, or without.

#include <filesystem>
#include <functional>

#include "harness/run/runner.h"

namespace dexcheck {

/// When nothing but an expectation, or the error's own dynamics, fails, repeats the run up to where that was
/// worst, at most for kLongest, with half the time step and contacts as stiff as before. Where the check then
/// has at most kFirstOrder of its value, time stepping is the cause; otherwise the evidence says that half
/// the step changed nothing. Where the scenario declares imperfections of the plant, it is repeated without
/// them at the same step instead: they are the cause where they explain half of the error or more, and the
/// evidence says how much.
/// @param setup, loop, result of the run, which is judged. @param robot, mjcf its files. @param should_stop
/// asked before each step; what was stopped says nothing.
void LookForIntegrator(const Setup& setup, const ClosedLoop& loop, const std::filesystem::path& robot,
                       const std::filesystem::path& mjcf, const std::function<bool()>& should_stop,
                       RunResult* result);

}  // namespace dexcheck
