#pragma once

// The report of a recorded run: a page and its figures.

#include <filesystem>
#include <functional>

#include "harness/report/page.h"

namespace dexcheck {

/// Where a report goes.
struct ReportFiles {
  std::filesystem::path page;
  std::filesystem::path figures;  ///< Folder for the figures' PDF and PNG files; empty for none.
};

/// Makes pictures and replay of a run, as MakeRunScene.
using SceneMaker = std::function<RunScene(const RunData& run, const std::filesystem::path& folder)>;

/// RUN_DIR/report.html and RUN_DIR/figures.
ReportFiles MakeReportFiles(const std::filesystem::path& run_dir);

/// Writes the report, all of it or nothing. The page holds all that it shows; RUN_DIR/video.mp4, if it is
/// there, is embedded up to 20 MB.
/// @param run_dir folder with the run's log.h5.
/// @param make_scene called with a folder to put pictures in, from which they go to the figures' folder.
/// @throws InputError, one line, when there is no log, or one without rows, or a file cannot be written.
void WriteRunReport(const std::filesystem::path& run_dir, const ReportFiles& files,
                    const SceneMaker& make_scene = MakeRunScene);

}  // namespace dexcheck
