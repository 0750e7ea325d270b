#pragma once

#include <optional>

#include "harness/engine/engine.h"
#include "harness/view/controls.h"
#include "harness/view/frame_source.h"
#include "renders/overlay.h"
#include "renders/renderer.h"

namespace dexcheck {

/// What of a frame is drawn, and from where.
struct SceneLook {
  Viewpoint view;
  bool forces = true;
  double meters_per_newton = 0.01;   ///< Of arrows.
  std::optional<Arrow> mouse_force;  ///< At what is pulled.
};

/// Draws frames with the panel of the checks. For the thread that made it.
class ScenePainter {
 public:
  ScenePainter(const mjModel& model, int width, int height);

  Image Paint(const ViewFrame& frame, const SceneLook& look);

 private:
  const mjModel& model_;
  MjDataPtr data_;
  Renderer renderer_;
  Overlay overlay_;
};

}  // namespace dexcheck
