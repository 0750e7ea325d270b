#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/base/interrupts.h"
#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/cli/run_folder.h"
#include "harness/report/run_data.h"
#include "renders/video.h"

namespace dexcheck::cli {
namespace {

/// Reads "1280x720". @throws InputError unless both are even numbers that a picture can have.
void ReadSize(const std::string& text, int* width, int* height) {
  const auto read = [](std::string_view part, int most) {
    const int size = ParseNumber<int>(part).value_or(0);
    return size >= 32 && size <= most && size % 2 == 0 ? size : 0;
  };
  const size_t x = std::min(text.find('x'), text.size());
  *width = read(std::string_view(text).substr(0, x), 3840);
  *height = read(std::string_view(text).substr(std::min(x + 1, text.size())), 2160);
  if (*width == 0 || *height == 0)
    throw InputError("--size: must be WIDTHxHEIGHT, even numbers from 32x32 to 3840x2160, got " +
                     Quote(text));
}

/// Draws a run into a video, with a progress bar, on all processors, at most 8. @return false when the user
/// stopped it; nothing is then written.
/// @throws InputError when a camera is unknown or the file cannot be written.
bool WriteVideo(const RunView& run, VideoOptions options, const std::string& out, bool quiet) {
  options.workers = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8);
  const auto start = std::chrono::steady_clock::now();
  const long frames = CountFrames(run, options.fps);
  VideoWriter video(out, options);
  CatchInterrupts();
  ProgressBar bar("drawing", frames, quiet);
  const bool complete = RenderVideo(run, options, &video, [&](long done, long) { return bar.GoOn(done); });
  bar.Finish();
  if (!complete) {
    Warn(fmt::format("stopped after {} of {} frames; {} was not written", video.frames(), frames, out));
    return false;
  }
  video.Finish();
  if (!quiet) {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::error_code ignored;
    const double megabytes = static_cast<double>(std::filesystem::file_size(out, ignored)) / 1e6;
    fmt::print("{}: {} frames, {:.1f} s, {} x {}, {:.1f} MB, drawn in {:.0f} s\n", out, frames,
               static_cast<double>(frames) / options.fps, options.width, options.height, megabytes, seconds);
  }
  return true;
}

}  // namespace

bool WriteRunVideo(const std::filesystem::path& run_folder, const std::string& out, bool quiet) {
  const RecordedFrames run = ReadRecordedFrames(run_folder);
  VideoOptions options;
  options.forces = true;
  return WriteVideo({run.model.get(), &run.frames}, options, out, quiet);
}

namespace {

struct RenderRequest : Outputs {
  std::filesystem::path run_folder;
  std::string size = "1280x720";
  std::optional<double> still;
  std::string out;
  VideoOptions video;
  bool no_panel = false;
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
  WritePng(out, MakePainter(run, request.video)(*request.still));
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
  OutputFile summary(request.json_file);
  if (!request.still && !WriteVideo(run, request.video, out, request.quiet)) return kFailure;
  if (request.still) WriteStill(request, run, out);
  if (!request.json_file.empty()) {
    Json json = {{"file", out}, {"width", request.video.width}, {"height", request.video.height}};
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

void AddRenderCommand(CLI::App* app) {
  constexpr int kMostFramesPerSecond = 120;
  const auto [command, request] = AddRequest<RenderRequest>(
      app, "render", "Draw a recorded run as a video, or one instant of it",
      {"dexcheck render my_run --camera follow", "dexcheck render my_run --still 2.5 --out still.png"});
  AddOption(command, "RUN_DIR", &request->run_folder, "Folder of the run")->required()->type_name("");
  AddOption(command, "--out FILE", &request->out, "Video .mp4 or picture .png (in RUN_DIR by default)");
  AddOption(command, "--still T", &request->still, "One picture at this time of the run, s");
  AddOption(command, "--camera NAME", &request->video.camera,
            "overview (the default), follow, grasp, top, or another of the MJCF's; robot, object: close-ups; "
            "course: fixed, sees the whole way");
  AddOption(command, "--inset NAME", &request->video.inset, "A second camera in the lower right corner");
  AddOption(command, "--size WxH", &request->size, "Size of the picture in pixels")->capture_default_str();
  AddOption(command, "--fps N", &request->video.fps, "Frames a second")
      ->check(WholeNumber(1, kMostFramesPerSecond))
      ->capture_default_str();
  command->add_flag("--forces", request->video.forces, "Draw contact forces and friction cones");
  command->add_flag("--no-panel", request->no_panel, "Leave out the panel with time, errors and checks");
  command->add_flag("--quiet", request->quiet, "Print nothing");
  AddJsonOption(command, "what was drawn", &request->json_file);
}

}  // namespace dexcheck::cli
