#include "harness/cli/make_report.h"

#include <algorithm>
#include <array>
#include <vector>

#include "harness/cli/run_frames_reader.h"
#include "harness/log/log_reader.h"
#include "renders/movie.h"
#include "renders/png_file.h"
#include "renders/renderer.h"

namespace dexcheck::cli {
namespace {

/// None when the log has no positions to draw.
std::vector<Picture> DrawConfigurations(const std::filesystem::path& run_folder,
                                        const std::filesystem::path& folder) {
  const LogReader log(run_folder / "log.h5");
  const bool has_positions =
      std::any_of(log.signals().begin(), log.signals().end(),
                  [](const SignalInfo& signal) { return signal.name == "engine/qpos"; });
  if (!has_positions) return {};
  const RecordedFrames run = ReadRecordedFrames(run_folder);
  const std::array<RunView, 1> views = {{{run.model.get(), &run.frames}}};
  MovieOptions options;
  options.width = 960;
  options.height = 600;
  options.camera = kCourseCamera;  // so that one sees how far it came
  options.tracks = true;
  options.panel = false;
  MoviePainter painter(views, options);
  const std::array<Picture, 2> pictures = {
      {{folder / "fig11a.png", "11 (a)", "Robot and object at the beginning"},
       {folder / "fig11b.png", "11 (b)", "Robot and object at the end"}}};
  const double duration = run.frames.times.back() - run.frames.times.front();
  WritePng(pictures[0].file, painter.Paint(0.0));
  WritePng(pictures[1].file, painter.Paint(duration));
  return {pictures.begin(), pictures.end()};
}

}  // namespace

void MakeReport(const std::filesystem::path& run_folder, const ReportFiles& files) {
  WriteRunReport(run_folder, files,
                 [&](const std::filesystem::path& folder) { return DrawConfigurations(run_folder, folder); });
}

}  // namespace dexcheck::cli
