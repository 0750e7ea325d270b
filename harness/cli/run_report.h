#pragma once

#include <string>

#include "harness/cli/report.h"
#include "harness/run/run_summary.h"

namespace dexcheck::cli {

/// How much is printed of a run.
enum class Detail {
  kCategories,  ///< A line for each question, and each check that fails.
  kAll,         ///< Each check.
};

/// Returns a run's verdict, and below it tracking, checks, speed, and where the files are.
/// @param summary of the run. @param folder empty when nothing was written.
Report MakeRunReport(const Setup& setup, const ClosedLoop& loop, const RunResult& result, const Json& summary,
                     const std::string& folder, Detail detail);

}  // namespace dexcheck::cli
