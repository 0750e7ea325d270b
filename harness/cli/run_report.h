#pragma once

#include <string>
#include <vector>

#include "harness/run/run_summary.h"

namespace dexcheck::cli {

/// How much is printed of a run.
enum class Detail {
  kCategories,  ///< A line for each question, and each check that fails.
  kAll,         ///< Each check.
};

/// Returns the checks of the model and of the motion that the run has; none of a run that was not checked.
std::vector<CheckRecord> ListChecksOf(const ClosedLoop& loop);

/// Prints what stands below a run's verdict: tracking, checks, speed, where the files are.
/// @param folder empty when nothing was written.
void PrintRunReport(const Setup& setup, const ClosedLoop& loop, const RunResult& result,
                    const std::string& folder, Detail detail);

/// Its checks as a JUnit document; an unfinished run is an error.
std::string WriteJUnit(const Setup& setup, const ClosedLoop& loop, const RunResult& result);

}  // namespace dexcheck::cli
