#include "renders/video_writer.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "renders/cairo_surface.h"

namespace dexcheck {

Ffmpeg::Ffmpeg(const PartialFile& file, int width, int height, int fps,
               const std::vector<std::string>& encoding)
    : file_(file) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) file_.Fail(std::strerror(errno));
  input_ = FileDescriptor(ends[0]);
  std::vector<std::string> words = {
      FindProgram("ffmpeg"), "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s"};
  words.push_back(std::to_string(width) + "x" + std::to_string(height));
  words.insert(words.end(), {"-r", std::to_string(fps), "-i", "pipe:0"});
  words.insert(words.end(), encoding.begin(), encoding.end());
  // The same pictures give the same bytes.
  words.insert(words.end(), {"-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"});
  words.insert(words.end(), {"-y", "file:" + file_.partial().string()});
  process_.emplace("ffmpeg", Program{words, ends[1], messages_.descriptor(), messages_.descriptor()});
  ::close(ends[1]);
}

Ffmpeg::~Ffmpeg() { CloseInput(); }

void Ffmpeg::CloseInput() {
  // Also of copies that processes forked meanwhile have.
  if (input_.is_open()) ::shutdown(input_.get(), SHUT_RDWR);
  input_.Close();
}

void Ffmpeg::Write(const Image& image) {
  const std::string_view bytes(reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size());
  if (!Send(input_.get(), bytes)) Fail();
}

void Ffmpeg::Finish() {
  CloseInput();
  const ProcessEnd end = process_->Wait();
  if (end.has_succeeded()) return;
  std::string reason = messages_.ReadLastLine();
  if (end.exit_code == kNotFoundExitCode) reason = "ffmpeg cannot be run (Debian's package ffmpeg has it)";
  file_.Fail(end.signal != 0 ? end.Describe("") : reason.empty() ? "ffmpeg failed" : "ffmpeg: " + reason);
}

void Ffmpeg::Fail() {
  Finish();
  file_.Fail("ffmpeg ended too early");
}

namespace {

/// By VideoFormat.
constexpr std::array<const char*, 3> kExtensions = {".mp4", ".webm", ".gif"};

const EncodingOptions& Checked(const EncodingOptions& options, VideoFormat format) {
  constexpr int kLargest = 16384;
  const auto check_size = [](const char* name, int value) {
    Require(value >= 2 && value <= kLargest && value % 2 == 0, name, "must be even and from 2 to 16384",
            value);
  };
  check_size("video width", options.width);
  check_size("video height", options.height);
  Require(options.fps >= 1 && options.fps <= 240, "frames a second", "must be from 1 to 240", options.fps);
  Require(format != VideoFormat::kGif || options.fps <= kMostGifFramesPerSecond, "frames a second",
          "must be at most 50 in a GIF", options.fps);
  return options;
}

/// ffmpeg's arguments.
std::vector<std::string> ListArguments(const EncodingOptions& options, VideoFormat format) {
  if (format == VideoFormat::kGif) {
    // The colours of all pictures, and no dithering, which would not stand still.
    return {"-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=none", "-loop", "0", "-f", "gif"};
  }
  std::vector<std::string> arguments = {"-vf",
                                        "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
                                        "-colorspace",
                                        "bt709",
                                        "-color_primaries",
                                        "bt709",
                                        "-color_trc",
                                        "bt709",
                                        "-color_range",
                                        "tv",
                                        "-g",
                                        std::to_string(2 * options.fps),
                                        "-threads",
                                        "1"};
  if (format == VideoFormat::kMp4) {
    // Otherwise x264 picks code by processor, and its AVX-512 code gives varying bytes for the same frames.
    arguments.insert(arguments.end(), {"-c:v", "libx264", "-preset", "veryfast", "-crf", "21", "-x264-params",
                                       "cpu-independent=1", "-movflags", "+faststart", "-f", "mp4"});
  } else {
    // Looks as the MP4 does: VP9's scale goes to 63.
    arguments.insert(arguments.end(), {"-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "31", "-deadline", "good",
                                       "-cpu-used", "5", "-f", "webm"});
  }
  return arguments;
}

}  // namespace

VideoFormat FindVideoFormat(const std::filesystem::path& path) {
  const auto found = std::ranges::find(kExtensions, ExtensionOf(path));
  if (found != kExtensions.end()) return static_cast<VideoFormat>(found - kExtensions.begin());
  throw InputError(path.string() + ": cannot be written: a video's name must end in .mp4, .webm or .gif");
}

VideoWriter::VideoWriter(const std::filesystem::path& path, const EncodingOptions& options)
    : file_(path),
      options_(Checked(options, FindVideoFormat(path))),
      ffmpeg_(file_, options.width, options.height, options.fps,
              ListArguments(options, FindVideoFormat(path))) {}

void VideoWriter::Write(const Image& image) {
  Require(image.width == options_.width, "frame width", "must be the video's", image.width);
  Require(image.height == options_.height, "frame height", "must be the video's", image.height);
  ffmpeg_.Write(image);
  ++frames_;
}

void VideoWriter::Finish() {
  if (frames_ == 0) file_.Fail("there are no frames");
  ffmpeg_.Finish();
  file_.Commit();
}

namespace {

bool IsJpeg(const std::filesystem::path& path) {
  const std::string extension = ExtensionOf(path);
  return extension == ".jpg" || extension == ".jpeg";
}

std::string EncodePng(const Image& image, const PartialFile& file) {
  const auto append = [](void* bytes, const unsigned char* data, unsigned count) {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), count);
    return CAIRO_STATUS_SUCCESS;
  };
  std::string bytes;
  const cairo_status_t status = cairo_surface_write_to_png_stream(ToSurface(image).get(), append, &bytes);
  if (status != CAIRO_STATUS_SUCCESS) file.Fail(cairo_status_to_string(status));
  return bytes;
}

}  // namespace

void RequirePictureName(const std::filesystem::path& path) {
  if (ExtensionOf(path) == ".png" || IsJpeg(path)) return;
  throw InputError(path.string() + ": cannot be written: a picture's name must end in .png, .jpg or .jpeg");
}

void WritePicture(const std::filesystem::path& path, const Image& image) {
  RequirePictureName(path);
  PartialFile file(path);
  if (IsJpeg(path)) {
    constexpr const char* kQuality = "2";  // 1 best, 31 worst
    Ffmpeg ffmpeg(
        file, image.width, image.height, 1,
        {"-frames:v", "1", "-pix_fmt", "yuvj444p", "-q:v", kQuality, "-c:v", "mjpeg", "-f", "mjpeg"});
    ffmpeg.Write(image);
    ffmpeg.Finish();
  } else {
    file.Write(EncodePng(image, file));
  }
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
