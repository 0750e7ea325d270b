#pragma once

#include <string>

#include "harness/report/run_data.h"

namespace dexcheck {

/// A table for LaTeX with booktabs: tracking errors, and of each category of checks the one nearest its
/// bound. Its caption names the verdict, the program's commit and the command.
/// @throws InputError that names the log when its summary is none.
std::string MakeTexTable(const RunData& run);

}  // namespace dexcheck
