#pragma once

#include <string>

#include "harness/run/run_summary.h"

namespace dexcheck::cli {

/// How much is printed of a run.
enum class Detail {
  kVerdict,
  kCategories,  ///< A line for each question, and each check that fails.
  kAll,         ///< Each check.
};

/// Prints what a person wants to know of a run: verdict, tracking, checks, cause, speed, where the files are.
/// @param folder empty when nothing was written.
void PrintRunReport(const Setup& setup, const ClosedLoop& loop, const RunResult& result,
                    const std::string& folder, Detail detail);

/// Its checks as a JUnit document; an unfinished run is an error.
std::string WriteJUnit(const Setup& setup, const ClosedLoop& loop, const RunResult& result);

}  // namespace dexcheck::cli
