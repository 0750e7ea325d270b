#pragma once

#include <string>

#include "harness/run/run_summary.h"

namespace dexcheck::cli {

/// Prints what a person wants to know of a run: verdict, tracking, checks, cause, speed, where the files are.
/// @param folder empty when nothing was written. @param quiet the verdict only.
void PrintRunReport(const Setup& setup, const ClosedLoop& loop, const RunResult& result,
                    const std::string& folder, bool quiet);

/// Its checks as a JUnit document; an unfinished run is an error.
std::string WriteJUnit(const Setup& setup, const ClosedLoop& loop, const RunResult& result);

}  // namespace dexcheck::cli
