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
  if (look.pull) decorations.emplace_back(*look.pull);
  Image image = renderer_.Render(*data_, look.view, decorations);
  OverlayState state;
  state.title = frame.frame.title;
  if (!frame.frame.phases.empty()) state.title += ": " + frame.frame.phases.front();
  state.time = frame.frame.times.front();
  if (!frame.frame.position_errors.empty()) state.position_error = frame.frame.position_errors.front();
  if (!frame.frame.joint_errors.empty()) state.joint_error = frame.frame.joint_errors.front();
  if (!frame.frame.orientation_errors.empty())
    state.orientation_error = frame.frame.orientation_errors.front();
  state.questions = frame.questions;
  overlay_.Draw(state, &image);
  return image;
}

}  // namespace dexcheck
