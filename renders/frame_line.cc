#include "renders/frame_line.h"

#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

constexpr long kSlots = 2;  // pictures of each process

// What a process tells; after all but the first comes the error's text.
constexpr char kDrawn = 'd';
constexpr char kInputError = 'i';
constexpr char kInvalidArgument = 'a';
constexpr char kError = 'e';
constexpr char kDied = '\0';  // told by none

// What it is told.
constexpr char kTaken = 't';

}  // namespace

void UnmapMemory::operator()(std::uint8_t* memory) const { ::munmap(memory, size); }

FrameLine::FrameLine(const std::function<Painter()>& make_painter, long frames, int workers, int width,
                     int height)
    : frames_(frames), num_workers_(std::min<long>(workers, frames)), width_(width), height_(height) {
  Require(frames >= 1, "frames", "must be positive", static_cast<double>(frames));
  Require(workers >= 1, "workers", "must be positive", workers);
  size_ = static_cast<std::size_t>(num_workers_ * kSlots) * Image(width, height).rgb.size();
  void* memory = ::mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED)
    throw Error(std::string("drawing: no memory for pictures: ") + std::strerror(errno));
  slots_ = {static_cast<std::uint8_t*>(memory), UnmapMemory{size_}};
  for (long k = 0; k < num_workers_; ++k) {
    workers_.emplace_back("drawing: a process", [&](int channel) { return Work(make_painter, k, channel); });
  }
}

std::uint8_t* FrameLine::FindSlot(long frame) const {
  const std::size_t picture = size_ / static_cast<std::size_t>(num_workers_ * kSlots);
  return slots_.get() + static_cast<std::size_t>(frame % (num_workers_ * kSlots)) * picture;
}

bool FrameLine::Work(const std::function<Painter()>& make_painter, long first, int channel) const {
  std::string told;
  try {
    Draw(make_painter, first, channel);
    return true;
  } catch (const InputError& error) {
    told = kInputError + std::string(error.what());
  } catch (const std::invalid_argument& error) {
    told = kInvalidArgument + std::string(error.what());
  } catch (const std::exception& error) {
    told = kError + std::string(error.what());
  } catch (...) {
    told = kError + std::string("unknown error");
  }
  Send(channel, told);
  return false;
}

void FrameLine::Draw(const std::function<Painter()>& make_painter, long first, int channel) const {
  const Painter paint = make_painter();
  for (long frame = first; frame < frames_; frame += num_workers_) {
    const Image image = paint(frame);
    Require(image.width == width_, "frame width", "must be the video's", image.width);
    Require(image.height == height_, "frame height", "must be the video's", image.height);
    const bool is_slot_free = frame < kSlots * num_workers_ || !Receive(channel, 1).empty();
    if (!is_slot_free) return;
    std::copy(image.rgb.begin(), image.rgb.end(), FindSlot(frame));
    if (!Send(channel, std::string_view(&kDrawn, 1))) return;
  }
}

Image FrameLine::Take() {
  Require(taken_ < frames_, "frame", "must be one of the video's", static_cast<double>(taken_));
  ChildProcess& worker = workers_[static_cast<std::size_t>(taken_ % num_workers_)];
  const std::string told = Receive(worker.channel(), 1);
  if (told != std::string{kDrawn}) Fail(&worker, told.empty() ? kDied : told.front());
  Image image(width_, height_);
  std::copy_n(FindSlot(taken_), image.rgb.size(), image.rgb.begin());
  ++taken_;
  // A process that has drawn its last frame may have ended.
  Send(worker.channel(), std::string_view(&kTaken, 1));
  return image;
}

void FrameLine::Fail(ChildProcess* worker, char told) {
  std::string text;
  for (std::string part = Receive(worker->channel(), 4096); !part.empty();
       part = Receive(worker->channel(), 4096))
    text += part;
  ProcessEnd end;
  if (worker->pid() >= 0) end = worker->Wait();
  if (told == kInputError) throw InputError(text);
  if (told == kInvalidArgument) throw std::invalid_argument(text);
  if (told == kDied) text = end.Describe("it ended too early");
  throw Error((told == kDied ? "drawing: a process died: " : "drawing: ") + text);
}

}  // namespace dexcheck
