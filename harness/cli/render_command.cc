#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/files.h"
#include "harness/cli/commands.h"
#include "harness/cli/make_video.h"
#include "harness/cli/output_file.h"
#include "harness/cli/run_folder.h"
#include "harness/report/run_data.h"
#include "renders/video.h"
#include "renders/video_writer.h"

namespace dexcheck::cli {
namespace {

struct RenderRequest {
  std::filesystem::path run_folder;
  std::string beside;
  std::string ghost;
  std::string size = "1280x720";
  std::optional<double> still;
  std::string out;
  VideoOptions video;
  std::vector<double> from;
  std::string look_at;
  bool follow = false;
  double orbit = 0.0;  // degrees a second
  bool no_panel = false;
  bool quiet = false;
  std::string json_file;
};

void WriteStill(const RenderRequest& request, const std::vector<RunView>& views, const std::string& out) {
  double longest = 0.0;
  double end = 0.0;
  for (const RunView& view : views) {
    longest = std::max(longest, view.frames->duration());
    // The end of the last step is no row of its own.
    const std::vector<double>& times = view.frames->times;
    end = std::max(end, view.frames->duration() + times.back() - times[times.size() - 2]);
  }
  constexpr double kTimeRounding = 1e-9;
  if (!(*request.still >= 0.0 && *request.still <= end + kTimeRounding)) {
    throw InputError("--still: must be from 0 to " + FormatNumber(longest) + " s, got " +
                     FormatNumber(*request.still));
  }
  WritePicture(out, VideoPainter(views, request.video).Paint(*request.still));
  if (!request.quiet) {
    fmt::print("{}: {:.2f} s of the run, {} x {}\n", out, *request.still, request.video.width,
               request.video.height);
  }
}

/// The camera of --from and its companions; none without.
std::optional<FreeCamera> MakeFreeCamera(const RenderRequest& request) {
  if (request.from.empty()) return std::nullopt;
  FreeCamera camera;
  camera.from = {request.from[0], request.from[1], request.from[2]};
  camera.follow = request.follow;
  camera.orbit = DegToRad(request.orbit);
  if (request.look_at.empty() || request.look_at == "object") return camera;
  std::istringstream text(request.look_at);
  Vector3d point;
  char comma = ',';
  char comma_after = ',';
  text >> point.x() >> comma >> point.y() >> comma_after >> point.z();
  if (!text || !(text >> std::ws).eof() || comma != ',' || comma_after != ',' || !point.allFinite()) {
    throw InputError("--look-at: must be object or X,Y,Z in m, got " + Quote(request.look_at));
  }
  if (point == camera.from)
    throw InputError("--look-at: must be elsewhere than --from, got " + request.look_at);
  camera.look_at = point;
  return camera;
}

/// What the name of the output says is what it gets.
void CheckOutput(const RenderRequest& request, const std::string& out) {
  if (IsFolder(out)) throw InputError(out + ": cannot be written: " + std::strerror(EISDIR));
  if (request.still) {
    RequirePictureName(out);
  } else if (FindVideoFormat(out) == VideoFormat::kGif && request.video.fps > kMostGifFramesPerSecond) {
    throw InputError(fmt::format("--fps: must be at most {} for a GIF, got {}", kMostGifFramesPerSecond,
                                 request.video.fps));
  }
}

ExitCode Run(RenderRequest request) {
  request.quiet |= request.json_file == "-";
  ReadSize(request.size, &request.video.width, &request.video.height);
  std::string out = request.out;
  if (out.empty()) out = (request.run_folder / (request.still ? "still.png" : "video.mp4")).string();
  CheckOutput(request, out);
  request.video.panel = !request.no_panel;
  request.video.free = MakeFreeCamera(request);
  std::vector<RecordedFrames> runs;
  runs.push_back(ReadRecordedFrames(request.run_folder));
  request.video.ghost = !request.ghost.empty();
  for (const std::string& other : {request.beside, request.ghost}) {
    if (!other.empty()) runs.push_back(ReadRecordedFrames(other));
  }
  std::vector<RunView> views;
  views.reserve(runs.size());
  for (const RecordedFrames& run : runs) views.push_back({run.model.get(), &run.frames});
  ResultFile summary(request.json_file);
  if (!request.still && !WriteVideo(views, request.video, out, request.quiet)) return kFailure;
  if (request.still) WriteStill(request, views, out);
  if (!request.json_file.empty()) {
    nlohmann::ordered_json json = {
        {"file", out}, {"width", request.video.width}, {"height", request.video.height}};
    if (request.still) {
      json["time_s"] = *request.still;
    } else {
      json["frames"] = CountFrames(views, request.video.fps);
      json["frames_per_second"] = request.video.fps;
    }
    summary.Write([&] { return json.dump(1) + "\n"; });
  }
  if (!request.quiet) WarnOfCut(request.run_folder, LogReader(request.run_folder / "log.h5"));
  return kSuccess;
}

}  // namespace

void AddRenderCommand(Command app) {
  constexpr int kMostFramesPerSecond = 120;
  constexpr int kMostJobs = 64;
  const auto request = std::make_shared<RenderRequest>();
  request->video.workers = CountDrawers();
  Command command = app.AddCommand("render", "Draw a recorded run as a video, or one instant of it");
  command.AddOption("RUN_DIR", &request->run_folder, "Folder of the run").Required().TypeName("");
  command.AddOption(
      "--out FILE", &request->out,
      "A video .mp4, .webm or .gif, or a picture .png or .jpg (default: video.mp4 or still.png in "
      "RUN_DIR)");
  command.AddOption("--still T", &request->still, "One picture at this time of the run, s");
  Option camera = command.AddOption("--camera NAME", &request->video.camera,
                                    "overview (the default), follow, grasp, top, or another of the MJCF's; "
                                    "robot and object are near "
                                    "to those; course stands still and sees the whole way");
  Option from =
      command
          .AddOption("--from X,Y,Z", &request->from, "Where a camera of your own stands at the beginning, m")
          .Delimiter(',')
          .Takes(3)
          .Excludes(camera);
  command
      .AddOption("--look-at X,Y,Z", &request->look_at,
                 "What that camera looks at: object, or a point, m (object by default)")
      .Needs(from);
  command.AddFlag("--follow", &request->follow, "That camera moves along with the object").Needs(from);
  command
      .AddOption("--orbit DEG", &request->orbit, "That camera turns about what it looks at, degrees a second")
      .Needs(from);
  command.AddOption("--inset NAME", &request->video.inset, "A second camera in the lower right corner");
  Option beside = command.AddOption("--beside RUN_DIR", &request->beside, "Another run, shown at the right");
  command.AddOption("--ghost RUN_DIR", &request->ghost, "Another run, as a ghost in the same scene")
      .Excludes(beside);
  command.AddOption("--size WxH", &request->size, "Size of the picture in pixels").ShowDefault();
  command.AddOption("--fps N", &request->video.fps, "Frames a second")
      .Check(WholeNumber(1, kMostFramesPerSecond))
      .ShowDefault();
  command
      .AddOption("--jobs N", &request->video.workers,
                 "Processes that draw; default: one for each processor, at most 8")
      .Check(WholeNumber(1, kMostJobs));
  command.AddFlag("--forces", &request->video.forces, "Draw contact forces and friction cones");
  command.AddFlag("--tracks", &request->video.tracks, "Draw the contacts' tracks and the object's path");
  command.AddFlag("--frames", &request->video.frames, "Draw the object's axes");
  command.AddFlag("--no-panel", &request->no_panel, "Leave out the panel with time, errors and checks");
  command.AddFlag("--quiet", &request->quiet, "Print nothing");
  AddJsonOption(command, "what was drawn", &request->json_file);
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
