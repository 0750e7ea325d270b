#include "harness/cli/make_video.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <system_error>
#include <thread>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/console.h"
#include "harness/base/interrupts.h"
#include "harness/cli/terminal.h"
#include "harness/report/run_data.h"

namespace dexcheck::cli {

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

bool WriteVideo(const RunView& run, VideoOptions options, const std::string& out, bool quiet) {
  options.workers = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8);
  const auto start = std::chrono::steady_clock::now();
  EncodingOptions encoding;
  encoding.width = options.width;
  encoding.height = options.height;
  encoding.fps = options.fps;
  const long frames = CountFrames(run, options.fps);
  VideoWriter video(out, encoding);
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

bool WriteRunVideo(const std::filesystem::path& run_folder, const std::string& out, bool quiet) {
  const RecordedFrames run = ReadRecordedFrames(run_folder);
  VideoOptions options;
  options.forces = true;
  return WriteVideo({run.model.get(), &run.frames}, options, out, quiet);
}

}  // namespace dexcheck::cli
