#include "renders/frame_line.h"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include "controller/common/errors.h"
#include "harness/base/interrupts.h"

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

/// @return false when the other side has ended.
bool Send(int socket, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::send(socket, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (count < 0 && errno != EINTR) return false;
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  return true;
}

/// At most `size` bytes; none when the other side has ended.
std::string Receive(int socket, std::size_t size) {
  std::string bytes(size, '\0');
  ssize_t count = 0;
  do {
    count = ::recv(socket, bytes.data(), size, 0);
  } while (count < 0 && errno == EINTR);
  bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  return bytes;
}

[[noreturn]] void FailToStart(const char* what) {
  throw Error(std::string("drawing: no ") + what + ": " + std::strerror(errno));
}

}  // namespace

FrameLine::FrameLine(const std::function<Painter()>& make_painter, long frames, int workers, int width,
                     int height)
    : frames_(frames), num_workers_(std::min<long>(workers, frames)), width_(width), height_(height) {
  Require(frames >= 1, "frames", "must be positive", static_cast<double>(frames));
  Require(workers >= 1, "workers", "must be positive", workers);
  size_ = static_cast<std::size_t>(num_workers_ * kSlots) * Image(width, height).rgb.size();
  void* memory = ::mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) FailToStart("memory for pictures");
  slots_ = static_cast<std::uint8_t*>(memory);
  try {
    for (long k = 0; k < num_workers_; ++k) Start(make_painter, k);
  } catch (...) {
    Stop();
    throw;
  }
}

FrameLine::~FrameLine() { Stop(); }

void FrameLine::Stop() {
  for (const Worker& worker : workers_) {
    ::close(worker.socket);
    if (worker.pid < 0) continue;
    ::kill(worker.pid, SIGKILL);
    ::waitpid(worker.pid, nullptr, 0);
  }
  ::munmap(slots_, size_);
}

std::uint8_t* FrameLine::FindSlot(long frame) const {
  const std::size_t picture = size_ / static_cast<std::size_t>(num_workers_ * kSlots);
  return slots_ + static_cast<std::size_t>(frame % (num_workers_ * kSlots)) * picture;
}

void FrameLine::Start(const std::function<Painter()>& make_painter, long index) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) FailToStart("socket");
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(EXIT_FAILURE);
    Work(make_painter, index, ends[1]);
  }
  const int error = errno;
  ::close(ends[1]);
  if (pid < 0) {
    ::close(ends[0]);
    errno = error;
    FailToStart("process");
  }
  workers_.push_back({pid, ends[0]});
}

void FrameLine::Work(const std::function<Painter()>& make_painter, long first, int socket) const {
  LeaveInterruptsToParent();
  std::string told;
  try {
    Draw(make_painter, first, socket);
    ::_exit(EXIT_SUCCESS);
  } catch (const InputError& error) {
    told = kInputError + std::string(error.what());
  } catch (const std::invalid_argument& error) {
    told = kInvalidArgument + std::string(error.what());
  } catch (const std::exception& error) {
    told = kError + std::string(error.what());
  } catch (...) {
    told = kError + std::string("unknown error");
  }
  Send(socket, told);
  ::_exit(EXIT_FAILURE);
}

void FrameLine::Draw(const std::function<Painter()>& make_painter, long first, int socket) const {
  const Painter paint = make_painter();
  for (long frame = first; frame < frames_; frame += num_workers_) {
    const Image image = paint(frame);
    Require(image.width == width_, "frame width", "must be the film's", image.width);
    Require(image.height == height_, "frame height", "must be the film's", image.height);
    const bool is_slot_free = frame < kSlots * num_workers_ || !Receive(socket, 1).empty();
    if (!is_slot_free) return;
    std::copy(image.rgb.begin(), image.rgb.end(), FindSlot(frame));
    if (!Send(socket, {kDrawn})) return;
  }
}

Image FrameLine::Take() {
  Require(taken_ < frames_, "frame", "must be one of the film's", static_cast<double>(taken_));
  Worker& worker = workers_[static_cast<std::size_t>(taken_ % num_workers_)];
  const std::string told = Receive(worker.socket, 1);
  if (told != std::string{kDrawn}) Fail(&worker, told.empty() ? kDied : told.front());
  Image image(width_, height_);
  std::copy_n(FindSlot(taken_), image.rgb.size(), image.rgb.begin());
  ++taken_;
  // A process that has drawn its last frame may have ended.
  Send(worker.socket, {kTaken});
  return image;
}

void FrameLine::Fail(Worker* worker, char told) {
  std::string text;
  for (std::string part = Receive(worker->socket, 4096); !part.empty(); part = Receive(worker->socket, 4096))
    text += part;
  int status = 0;
  if (worker->pid >= 0) ::waitpid(std::exchange(worker->pid, -1), &status, 0);
  if (told == kInputError) throw InputError(text);
  if (told == kInvalidArgument) throw std::invalid_argument(text);
  if (told == kDied) text = WIFSIGNALED(status) ? ::strsignal(WTERMSIG(status)) : "it ended too early";
  throw Error((told == kDied ? "drawing: a process died: " : "drawing: ") + text);
}

}  // namespace dexcheck
