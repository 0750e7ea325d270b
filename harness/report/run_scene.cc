#include "harness/report/run_scene.h"

#include <array>

#include "harness/report/recorded_frames.h"
#include "renders/course.h"
#include "renders/picture_file.h"
#include "renders/renderer.h"
#include "renders/video.h"

namespace dexcheck {
namespace {

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
  WritePicture(pictures[0].file, painter.Paint(0.0));
  WritePicture(pictures[1].file, painter.Paint(run.frames.duration()));
  return {pictures.begin(), pictures.end()};
}

}  // namespace

RunScene MakeRunScene(const RunData& run, const std::filesystem::path& folder) {
  if (run.Find("engine/qpos") == nullptr) return {};
  const RecordedFrames frames = ReadRecordedFrames(run.log());
  return {DrawConfigurations(frames, !run.moves_joints(), folder),
          MakeReplayData(*frames.model, frames.frames)};
}

}  // namespace dexcheck
