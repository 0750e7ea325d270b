#include "renders/video_writer.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "renders/cairo_surface.h"

namespace dexcheck {
namespace {

/// @throws InputError for another name, std::invalid_argument for options that H.264 cannot take.
const EncodingOptions& Checked(const EncodingOptions& options, const std::filesystem::path& path) {
  RequireExtension(path, ".mp4");
  constexpr int kLargest = 16384;
  const auto check_size = [](const char* name, int value) {
    Require(value >= 2 && value <= kLargest && value % 2 == 0, name, "must be even and from 2 to 16384",
            value);
  };
  check_size("video width", options.width);
  check_size("video height", options.height);
  Require(options.fps >= 1 && options.fps <= 240, "frames a second", "must be from 1 to 240", options.fps);
  return options;
}

/// ffmpeg and its arguments. The same pictures give the same bytes: without cpu-independent, x264 picks code
/// by processor, and its AVX-512 code gives varying bytes for the same frames.
std::vector<std::string> MakeCommand(const PartialFile& file, const EncodingOptions& options) {
  const std::string size = std::to_string(options.width) + "x" + std::to_string(options.height);
  std::vector<std::string> words = {FindProgram("ffmpeg")};
  const auto add = [&](std::initializer_list<std::string> some) {
    words.insert(words.end(), some.begin(), some.end());
  };
  add({"-v", "error"});
  add({"-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", std::to_string(options.fps)});
  add({"-i", "pipe:0"});
  add({"-vf", "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p"});
  add({"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"});
  add({"-g", std::to_string(2 * options.fps), "-threads", "1"});
  add({"-c:v", "libx264", "-preset", "veryfast", "-crf", "21", "-x264-params", "cpu-independent=1"});
  add({"-movflags", "+faststart", "-f", "mp4"});
  add({"-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"});
  add({"-y", "file:" + file.partial().string()});
  return words;
}

}  // namespace

void RequireExtension(const std::filesystem::path& path, const char* extension) {
  if (ExtensionOf(path) == extension) return;
  throw InputError(path.string() + ": cannot be written: the name must end in " + extension);
}

VideoWriter::VideoWriter(const std::filesystem::path& path, const EncodingOptions& options)
    : file_(path), options_(Checked(options, path)) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) file_.Fail(std::strerror(errno));
  input_ = FileDescriptor(ends[0]);
  const int messages = messages_.descriptor();
  process_.emplace("ffmpeg", Program{MakeCommand(file_, options_), ends[1], messages, messages});
  ::close(ends[1]);
}

VideoWriter::~VideoWriter() { CloseInput(); }

void VideoWriter::CloseInput() {
  // Also of copies that processes forked meanwhile have.
  if (input_.is_open()) ::shutdown(input_.get(), SHUT_RDWR);
  input_.Close();
}

void VideoWriter::Write(const Image& image) {
  Require(image.width == options_.width, "frame width", "must be the video's", image.width);
  Require(image.height == options_.height, "frame height", "must be the video's", image.height);
  const std::string_view bytes(reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size());
  if (!Send(input_.get(), bytes)) {
    FinishEncoding();
    file_.Fail("ffmpeg ended too early");
  }
  ++frames_;
}

void VideoWriter::Finish() {
  if (frames_ == 0) file_.Fail("there are no frames");
  FinishEncoding();
  file_.Commit();
}

void VideoWriter::FinishEncoding() {
  CloseInput();
  const ProcessEnd end = process_->Wait();
  if (end.has_succeeded()) return;
  std::string reason = messages_.ReadLastLine();
  if (end.exit_code == kNotFoundExitCode) reason = "ffmpeg cannot be run (Debian's package ffmpeg has it)";
  file_.Fail(end.signal != 0 ? end.Describe("") : reason.empty() ? "ffmpeg failed" : "ffmpeg: " + reason);
}

void WritePng(const std::filesystem::path& path, const Image& image) {
  RequireExtension(path, ".png");
  PartialFile file(path);
  const auto append = [](void* bytes, const unsigned char* data, unsigned count) {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), count);
    return CAIRO_STATUS_SUCCESS;
  };
  std::string bytes;
  const cairo_status_t status = cairo_surface_write_to_png_stream(ToSurface(image).get(), append, &bytes);
  if (status != CAIRO_STATUS_SUCCESS) file.Fail(cairo_status_to_string(status));
  file.Write(bytes);
  file.Commit();
}

Image ReadPng(const std::filesystem::path& path) {
  const SurfacePtr surface(cairo_image_surface_create_from_png(path.c_str()));
  const cairo_status_t status = cairo_surface_status(surface.get());
  if (status != CAIRO_STATUS_SUCCESS)
    throw InputError(path.string() + ": cannot be read: " + cairo_status_to_string(status));
  Image image(cairo_image_surface_get_width(surface.get()), cairo_image_surface_get_height(surface.get()));
  CopySurface(surface.get(), &image);
  return image;
}

}  // namespace dexcheck
