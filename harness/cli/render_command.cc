#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/cli/commands.h"
#include "harness/cli/make_video.h"
#include "harness/report/recorded_frames.h"
#include "renders/movie.h"
#include "renders/picture_file.h"
#include "renders/video_writer.h"

namespace dexcheck::cli {
namespace {

struct Request {
  std::filesystem::path run_folder;
  std::string beside;
  std::string size = "1280x720";
  std::optional<double> still;
  std::string out;
  MovieOptions movie;
  bool no_panel = false;
  bool quiet = false;
};

/// "1280x720" into the options.
void ReadSize(const std::string& text, MovieOptions* movie) {
  const char* const end = text.data() + text.size();
  const std::from_chars_result width = std::from_chars(text.data(), end, movie->width);
  if (width.ec == std::errc() && width.ptr != end && *width.ptr == 'x') {
    const std::from_chars_result height = std::from_chars(width.ptr + 1, end, movie->height);
    const auto is_size = [](int value, int most) { return value >= 32 && value <= most && value % 2 == 0; };
    if (height.ec == std::errc() && height.ptr == end && is_size(movie->width, 3840) &&
        is_size(movie->height, 2160)) {
      return;
    }
  }
  throw InputError("--size: must be WIDTHxHEIGHT, even numbers from 32x32 to 3840x2160, got " + Quote(text));
}

double Duration(const RunFrames& run) { return run.times.back() - run.times.front(); }

/// Of the last step, whose end is no row of its own, s.
double LastStep(const RunFrames& run) { return run.times.back() - run.times[run.times.size() - 2]; }

void WriteStill(const Request& request, const std::vector<RunView>& views, const std::string& out) {
  double longest = 0.0;
  double end = 0.0;
  for (const RunView& view : views) {
    longest = std::max(longest, Duration(*view.frames));
    end = std::max(end, Duration(*view.frames) + LastStep(*view.frames));
  }
  constexpr double kTimeRounding = 1e-9;
  if (!(*request.still >= 0.0 && *request.still <= end + kTimeRounding)) {
    throw InputError("--still: must be from 0 to " + FormatNumber(longest) + " s, got " +
                     FormatNumber(*request.still));
  }
  WritePicture(out, MoviePainter(views, request.movie).Paint(*request.still));
  if (!request.quiet) {
    fmt::print("{}: {:.2f} s of the run, {} x {}\n", out, *request.still, request.movie.width,
               request.movie.height);
  }
}

/// What the name of the output says is what it gets.
void CheckOutput(const Request& request, const std::string& out) {
  std::error_code ignored;
  if (std::filesystem::is_directory(out, ignored)) {
    throw InputError(out + ": cannot be written: " + std::strerror(EISDIR));
  }
  if (request.still) {
    RequirePictureName(out);
  } else if (FindVideoFormat(out) == VideoFormat::kGif && request.movie.fps > kMostGifFramesPerSecond) {
    throw InputError(fmt::format("--fps: must be at most {} for a GIF, got {}", kMostGifFramesPerSecond,
                                 request.movie.fps));
  }
}

ExitCode Run(Request request) {
  ReadSize(request.size, &request.movie);
  std::string out = request.out;
  if (out.empty()) out = (request.run_folder / (request.still ? "still.png" : "video.mp4")).string();
  CheckOutput(request, out);
  request.movie.panel = !request.no_panel;
  std::vector<RecordedFrames> runs;
  runs.push_back(ReadRecordedFrames(request.run_folder));
  if (!request.beside.empty()) runs.push_back(ReadRecordedFrames(request.beside));
  std::vector<RunView> views;
  views.reserve(runs.size());
  for (const RecordedFrames& run : runs) views.push_back({run.model.get(), &run.frames});
  if (!request.still) return WriteMovie(views, request.movie, out, request.quiet) ? kSuccess : kFailure;
  WriteStill(request, views, out);
  return kSuccess;
}

}  // namespace

void AddRenderCommand(Command app) {
  constexpr int kMostFramesPerSecond = 120;
  constexpr int kMostJobs = 64;
  const auto request = std::make_shared<Request>();
  request->movie.workers = CountDrawers();
  Command command = app.AddCommand("render", "Draw a recorded run as a video, or one instant of it");
  command.AddOption("RUN_DIR", &request->run_folder, "Folder of the run").Required().TypeName("");
  command
      .AddOption("--out", &request->out,
                 "A film .mp4, .webm or .gif, or a picture .png or .jpg (default: video.mp4 or still.png in "
                 "RUN_DIR)")
      .TypeName("FILE");
  command.AddOption("--still", &request->still, "One picture at this time of the run, s").TypeName("T");
  command
      .AddOption("--camera", &request->movie.camera,
                 "overview (the default), follow, grasp, top, or another of the MJCF's; course stands still "
                 "and sees the whole way")
      .TypeName("NAME");
  command.AddOption("--inset", &request->movie.inset, "A second camera in the lower right corner")
      .TypeName("NAME");
  command.AddOption("--beside", &request->beside, "Another run, shown at the right").TypeName("RUN_DIR");
  command.AddOption("--size", &request->size, "Of the picture in pixels").TypeName("WxH").ShowDefault();
  command.AddOption("--fps", &request->movie.fps, "Frames a second")
      .TypeName("N")
      .Check(WholeNumber(1, kMostFramesPerSecond))
      .ShowDefault();
  command
      .AddOption("--jobs", &request->movie.workers,
                 "Processes that draw; default: one for each processor, at most 8")
      .TypeName("N")
      .Check(WholeNumber(1, kMostJobs));
  command.AddFlag("--forces", &request->movie.forces, "Draw contact forces and friction cones");
  command.AddFlag("--tracks", &request->movie.tracks, "Draw the contacts' tracks and the object's path");
  command.AddFlag("--frames", &request->movie.frames, "Draw the object's axes");
  command.AddFlag("--no-panel", &request->no_panel, "Leave out the panel with time, errors and checks");
  command.AddFlag("--quiet", &request->quiet, "Print nothing");
  command.SetAction([=] { return Run(*request); });
}

}  // namespace dexcheck::cli
