#include "harness/report/run_scene.h"

#include <algorithm>
#include <array>

#include "harness/log/log_reader.h"
#include "harness/report/recorded_frames.h"
#include "renders/course.h"
#include "renders/png_file.h"
#include "renders/renderer.h"
#include "renders/video.h"

namespace dexcheck {
namespace {

bool HasSignal(const std::filesystem::path& run_dir, const char* name) {
  const LogReader log(run_dir / "log.h5");
  return std::any_of(log.signals().begin(), log.signals().end(),
                     [&](const SignalInfo& signal) { return signal.name == name; });
}

/// @param holds whether an object, as in the paper's figures.
std::vector<Picture> DrawConfigurations(const RecordedFrames& run, bool holds,
                                        const std::filesystem::path& folder) {
  const std::array<RunView, 1> views = {{{run.model.get(), &run.frames}}};
  VideoOptions options;
  options.width = 960;
  options.height = 600;
  options.camera = kRobotCamera;
  constexpr double kLongWay = 1.0;  // m, on which one wants to see how far it came
  const MjDataPtr data = MakeData(*run.model);
  if (FindWay(*run.model, run.frames, data.get()).length > kLongWay) options.inset = kCourseCamera;
  options.tracks = true;
  options.panel = false;
  VideoPainter painter(views, options);
  const std::string who = holds ? "Robot and object" : "Robot";
  const std::array<Picture, 2> pictures = {
      {{folder / "fig11a.png", holds ? "11 (a)" : "", who + " at the beginning"},
       {folder / "fig11b.png", holds ? "11 (b)" : "", who + " at the end"}}};
  const double duration = run.frames.times.back() - run.frames.times.front();
  WritePng(pictures[0].file, painter.Paint(0.0));
  WritePng(pictures[1].file, painter.Paint(duration));
  return {pictures.begin(), pictures.end()};
}

}  // namespace

RunScene MakeRunScene(const std::filesystem::path& run_dir, const std::filesystem::path& folder) {
  if (!HasSignal(run_dir, "engine/qpos")) return {};
  const RecordedFrames run = ReadRecordedFrames(run_dir);
  return {DrawConfigurations(run, !HasSignal(run_dir, "joints/q_d"), folder),
          MakeReplayData(*run.model, run.frames)};
}

}  // namespace dexcheck
