#include "harness/view/studio.h"

#include <chrono>
#include <utility>

#include "renders/run_decorations.h"

namespace dexcheck {

namespace {

RenderOptions MakeOptions(int width, int height) {
  RenderOptions options;
  options.width = width;
  options.height = height;
  options.camera = kCourseCamera;
  // For many pictures a second on a machine without a graphics card.
  options.samples = 1;
  options.shadow_size = 512;
  options.slices = 16;
  return options;
}

}  // namespace

ScenePainter::ScenePainter(const mjModel& model, int width, int height)
    : model_(model), data_(MakeData(model)), renderer_(model, MakeOptions(width, height)) {}

Image ScenePainter::Paint(const ViewFrame& frame, const SceneLook& look) {
  SetRow(model_, *frame.run, frame.row, data_.get());
  std::vector<Decoration> decorations;
  if (look.forces) AddForces(*frame.run, frame.row, look.meters_per_newton, &decorations);
  if (look.mouse_force) decorations.emplace_back(*look.mouse_force);
  Image image = renderer_.Render(*data_, look.view, decorations);
  overlay_.Draw(MakeOverlayState(*frame.run, frame.row, frame.categories), &image);
  return image;
}

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
