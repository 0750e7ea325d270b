#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
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
  std::string size = "1280x720";
  std::optional<double> still;
  std::string out;
  VideoOptions video;
  bool no_panel = false;
  bool quiet = false;
  std::string json_file;
};

void WriteStill(const RenderRequest& request, const RunView& run, const std::string& out) {
  // The end of the last step is no row of its own.
  const std::vector<double>& times = run.frames->times;
  const double end = run.frames->duration() + times.back() - times[times.size() - 2];
  constexpr double kTimeRounding = 1e-9;
  if (!(*request.still >= 0.0 && *request.still <= end + kTimeRounding)) {
    throw InputError("--still: must be from 0 to " + FormatNumber(run.frames->duration()) + " s, got " +
                     FormatNumber(*request.still));
  }
  WritePng(out, VideoPainter(run, request.video).Paint(*request.still));
  if (!request.quiet) {
    fmt::print("{}: {:.2f} s of the run, {} x {}\n", out, *request.still, request.video.width,
               request.video.height);
  }
}

ExitCode Run(RenderRequest request) {
  request.quiet |= request.json_file == "-";
  ReadSize(request.size, &request.video.width, &request.video.height);
  std::string out = request.out;
  if (out.empty()) out = (request.run_folder / (request.still ? "still.png" : "video.mp4")).string();
  if (IsFolder(out)) throw InputError(out + ": cannot be written: " + std::strerror(EISDIR));
  RequireExtension(out, request.still ? ".png" : ".mp4");
  request.video.panel = !request.no_panel;
  const RecordedFrames recorded = ReadRecordedFrames(request.run_folder);
  const RunView run = {recorded.model.get(), &recorded.frames};
  ResultFile summary(request.json_file);
  if (!request.still && !WriteVideo(run, request.video, out, request.quiet)) return kFailure;
  if (request.still) WriteStill(request, run, out);
  if (!request.json_file.empty()) {
    nlohmann::ordered_json json = {
        {"file", out}, {"width", request.video.width}, {"height", request.video.height}};
    if (request.still) {
      json["time_s"] = *request.still;
    } else {
      json["frames"] = CountFrames(run, request.video.fps);
      json["frames_per_second"] = request.video.fps;
    }
    summary.Write([&] { return json; });
  }
  if (!request.quiet) WarnOfCut(request.run_folder, LogReader(request.run_folder / "log.h5"));
  return kSuccess;
}

}  // namespace

void AddRenderCommand(Command app) {
  constexpr int kMostFramesPerSecond = 120;
  const auto request = std::make_shared<RenderRequest>();
  Command command = app.AddCommand("render", "Draw a recorded run as a video, or one instant of it");
  command.AddOption("RUN_DIR", &request->run_folder, "Folder of the run").Required().TypeName("");
  command.AddOption("--out FILE", &request->out,
                    "A video .mp4, or a picture .png (default: video.mp4 or still.png in RUN_DIR)");
  command.AddOption("--still T", &request->still, "One picture at this time of the run, s");
  command.AddOption("--camera NAME", &request->video.camera,
                    "overview (the default), follow, grasp, top, or another of the MJCF's; robot and object "
                    "are near to those; course stands still and sees the whole way");
  command.AddOption("--inset NAME", &request->video.inset, "A second camera in the lower right corner");
  command.AddOption("--size WxH", &request->size, "Size of the picture in pixels").ShowDefault();
  command.AddOption("--fps N", &request->video.fps, "Frames a second")
      .Check(WholeNumber(1, kMostFramesPerSecond))
      .ShowDefault();
  command.AddFlag("--forces", &request->video.forces, "Draw contact forces and friction cones");
  command.AddFlag("--no-panel", &request->no_panel, "Leave out the panel with time, errors and checks");
  command.AddFlag("--quiet", &request->quiet, "Print nothing");
  AddJsonOption(command, "what was drawn", &request->json_file);
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
