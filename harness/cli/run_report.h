#pragma once

#include <string>

#include "harness/cli/report.h"
#include "harness/run/run_summary.h"

namespace dexcheck::cli {

/// Returns a run's verdict, and below it tracking, checks, speed, and where the files are.
/// @param summary of the run. @param folder empty when nothing was written. @param all
/// whether each check has a line, and not each category and what fails of it.
Report MakeRunReport(const Setup& setup, const ClosedLoop& loop, const RunResult& result, const Json& summary,
                     const std::string& folder, bool all);

}  // namespace dexcheck::cli
