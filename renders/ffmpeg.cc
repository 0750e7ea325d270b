#include "renders/ffmpeg.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace dexcheck {

Ffmpeg::Ffmpeg(const PartialFile& file, int width, int height, int fps,
               const std::vector<std::string>& encoding)
    : file_(file) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) file_.Fail(std::strerror(errno));
  input_ = FileDescriptor(ends[0]);
  std::vector<std::string> words = {"ffmpeg", "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s"};
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

}  // namespace dexcheck
