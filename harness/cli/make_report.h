#pragma once

#include <filesystem>

#include "harness/report/write_report.h"

namespace dexcheck::cli {

/// WriteRunReport with the paper's Figure 11, the scene at the run's beginning and end.
/// @throws InputError as WriteRunReport.
void MakeReport(const std::filesystem::path& run_folder, const ReportFiles& files);

}  // namespace dexcheck::cli
