#include "harness/view/studio.h"

#include <chrono>
#include <utility>

namespace dexcheck {
namespace {

constexpr double kFrameTime = 0.02;  // s: at most so many pictures are drawn

}  // namespace

Studio::Studio(const FrameSource& source, int width, int height)
    : source_(source), thread_([this, width, height] { Work(width, height); }) {}

Studio::~Studio() {
  quit_ = true;
  thread_.join();
}

void Studio::Request(const Order& order) {
  const std::lock_guard lock(mutex_);
  order_ = order;
}

std::optional<Image> Studio::Take() {
  const std::lock_guard lock(mutex_);
  if (problem_) std::rethrow_exception(problem_);
  return std::exchange(image_, std::nullopt);
}

void Studio::Work(int width, int height) {
  try {
    ScenePainter painter(source_.model(), width, height);
    Controls controls;
    while (!quit_) {
      const auto begin = std::chrono::steady_clock::now();
      if (std::optional<Order> order = TakeOrder()) {
        Image image = painter.Paint(source_.Read(order->row), order->look);
        controls.Draw(order->controls, &image);
        const std::lock_guard lock(mutex_);
        image_ = std::move(image);
      }
      std::this_thread::sleep_until(begin + std::chrono::duration<double>(kFrameTime));
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    problem_ = std::current_exception();
  }
}

std::optional<Studio::Order> Studio::TakeOrder() {
  const std::lock_guard lock(mutex_);
  return std::exchange(order_, std::nullopt);
}

}  // namespace dexcheck
