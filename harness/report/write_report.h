#pragma once

// The report of a recorded run: a page and its figures.

#include <filesystem>
#include <functional>
#include <vector>

#include "harness/report/page.h"

namespace dexcheck {

/// Where a report goes.
struct ReportFiles {
  std::filesystem::path page;
  std::filesystem::path figures;  ///< Folder for the figures' SVG and PNG files; empty for none.
};

/// Makes pictures of the run in a folder.
using PictureMaker = std::function<std::vector<Picture>(const std::filesystem::path& folder)>;

/// RUN_DIR/report.html and RUN_DIR/figures.
ReportFiles MakeReportFiles(const std::filesystem::path& run_dir);

/// Writes the report, all of it or nothing. The page holds all that it shows; RUN_DIR/video.mp4, if it is
/// there, is embedded up to 20 MB.
/// @param run_dir folder with the run's log.h5.
/// @param make_pictures adds pictures of the run to the page; called with a folder to put them in, from which
/// they go to the figures' folder. May be empty.
/// @throws InputError, one line, when there is no log, or one without rows, or a file cannot be written.
void WriteRunReport(const std::filesystem::path& run_dir, const ReportFiles& files,
                    const PictureMaker& make_pictures = {});

}  // namespace dexcheck
