#include "renders/frame_line.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

// What a process sends: a picture's bytes after the first of these, an error's text after the others.
constexpr char kDrawn = 'd';
constexpr char kInputError = 'i';
constexpr char kInvalidArgument = 'a';
constexpr char kError = 'e';

/// Sends every n-th picture. @return whether all were drawn.
bool Work(const std::function<FrameLine::Painter()>& make_painter, const std::vector<long>& frames, int width,
          int height, int channel) {
  std::string message;
  try {
    const FrameLine::Painter paint = make_painter();
    for (const long frame : frames) {
      const Image image = paint(frame);
      Require(image.width == width, "frame width", "must be the video's", image.width);
      Require(image.height == height, "frame height", "must be the video's", image.height);
      const std::string_view bytes(reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size());
      if (!Send(channel, std::string_view(&kDrawn, 1)) || !Send(channel, bytes)) return false;
    }
    return true;
  } catch (const InputError& error) {
    message = kInputError + std::string(error.what());
  } catch (const std::invalid_argument& error) {
    message = kInvalidArgument + std::string(error.what());
  } catch (const std::exception& error) {
    message = kError + std::string(error.what());
  } catch (...) {
    message = kError + std::string("unknown error");
  }
  Send(channel, message);
  return false;
}

/// @param kind of the message whose text is still to be read; 0 when the process died.
[[noreturn]] void Fail(ChildProcess* worker, char kind) {
  std::string text;
  for (std::string part = Receive(worker->channel(), 4096); !part.empty();
       part = Receive(worker->channel(), 4096))
    text += part;
  ProcessEnd end;
  if (worker->pid() >= 0) end = worker->Wait();
  if (kind == kInputError) throw InputError(text);
  if (kind == kInvalidArgument) throw std::invalid_argument(text);
  if (kind == kError) throw Error("drawing: " + text);
  throw Error("drawing: a process died: " + end.Describe("it ended too early"));
}

}  // namespace

FrameLine::FrameLine(const std::function<Painter()>& make_painter, long frames, int workers, int width,
                     int height)
    : frames_(frames), width_(width), height_(height) {
  Require(frames >= 1, "frames", "must be positive", static_cast<double>(frames));
  Require(workers >= 1, "workers", "must be positive", workers);
  const long count = std::min<long>(workers, frames);
  for (long k = 0; k < count; ++k) {
    std::vector<long> own;
    for (long frame = k; frame < frames; frame += count) own.push_back(frame);
    workers_.emplace_back("drawing: a process",
                          [&](int channel) { return Work(make_painter, own, width, height, channel); });
  }
}

Image FrameLine::Take() {
  Require(taken_ < frames_, "frame", "must be one of the video's", static_cast<double>(taken_));
  ChildProcess& worker = workers_[static_cast<std::size_t>(taken_) % workers_.size()];
  const std::string kind = Receive(worker.channel(), 1);
  if (kind != std::string{kDrawn}) Fail(&worker, kind.empty() ? '\0' : kind.front());
  Image image(width_, height_);
  for (std::size_t done = 0; done < image.rgb.size();) {
    const std::string part = Receive(worker.channel(), image.rgb.size() - done);
    if (part.empty()) Fail(&worker, '\0');
    std::copy(part.begin(), part.end(), image.rgb.begin() + static_cast<long>(done));
    done += part.size();
  }
  ++taken_;
  return image;
}

}  // namespace dexcheck
