#include "harness/view/scene_painter.h"

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
  SetRow(model_, frame.frame, 0, data_.get());
  std::vector<Decoration> decorations;
  if (look.forces) AddForces(frame.frame, 0, look.meters_per_newton, &decorations);
  if (look.mouse_force) decorations.emplace_back(*look.mouse_force);
  Image image = renderer_.Render(*data_, look.view, decorations);
  overlay_.Draw(MakeOverlayState(frame.frame, 0, frame.categories), &image);
  return image;
}

}  // namespace dexcheck
