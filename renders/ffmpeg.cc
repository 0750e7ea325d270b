#include "renders/ffmpeg.h"

#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace dexcheck {

Ffmpeg::Ffmpeg(const PartialFile& file, int width, int height, int fps,
               const std::vector<std::string>& encoding)
    : file_(file), messages_(::memfd_create("ffmpeg", MFD_CLOEXEC)) {
  int ends[2];
  if (messages_ < 0 || ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    file_.Fail(std::strerror(errno));
  input_ = ends[0];
  std::vector<std::string> words = {"ffmpeg", "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s"};
  words.push_back(std::to_string(width) + "x" + std::to_string(height));
  words.insert(words.end(), {"-r", std::to_string(fps), "-i", "pipe:0"});
  words.insert(words.end(), encoding.begin(), encoding.end());
  // The same pictures give the same bytes.
  words.insert(words.end(), {"-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"});
  words.insert(words.end(), {"-y", "file:" + file_.partial().string()});
  process_.emplace("ffmpeg", Program{words, ends[1], messages_, messages_});
  ::close(ends[1]);
}

Ffmpeg::~Ffmpeg() {
  CloseInput();
  process_.reset();
  ::close(messages_);
}

void Ffmpeg::CloseInput() {
  if (input_ < 0) return;
  ::shutdown(input_, SHUT_RDWR);  // also of copies that processes forked meanwhile have
  ::close(std::exchange(input_, -1));
}

void Ffmpeg::Write(const Image& image) {
  const std::string_view bytes(reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size());
  if (!Send(input_, bytes)) Fail();
}

void Ffmpeg::Finish() {
  CloseInput();
  const ProcessEnd end = process_->Wait();
  if (end.has_succeeded()) return;
  std::array<char, 4096> text{};
  const ssize_t size = ::pread(messages_, text.data(), text.size() - 1, 0);
  std::string reason(text.data(), static_cast<size_t>(std::max<ssize_t>(size, 0)));
  while (!reason.empty() && reason.back() == '\n') reason.pop_back();
  reason.erase(0, reason.rfind('\n') + 1);  // its last line
  if (end.exit_code == kNotFoundExitCode) reason = "ffmpeg cannot be run (Debian's package ffmpeg has it)";
  file_.Fail(end.signal != 0 ? end.Describe("") : reason.empty() ? "ffmpeg failed" : "ffmpeg: " + reason);
}

void Ffmpeg::Fail() {
  Finish();
  file_.Fail("ffmpeg ended too early");
}

}  // namespace dexcheck
