#pragma once

// Draws the window's pictures in a thread of its own.

#include <atomic>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "harness/engine/engine.h"
#include "harness/view/controls.h"
#include "harness/view/frame_source.h"
#include "renders/image.h"
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

/// Of the pictures that were requested, the newest one is what counts.
class Studio {
 public:
  /// @param source must outlive it. @param width, height in pixels.
  Studio(const FrameSource& source, int width, int height);
  ~Studio();
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;

  struct Order {
    long row = 0;
    SceneLook look;
    ControlsState controls;
  };
  void Request(const Order& order);
  /// None when there is none since the last call. @throws what drawing threw.
  std::optional<Image> Take();

 private:
  void Work(int width, int height);
  std::optional<Order> TakeOrder();

  const FrameSource& source_;
  std::mutex mutex_;
  std::optional<Order> order_;
  std::optional<Image> image_;
  std::exception_ptr problem_;
  std::atomic<bool> quit_ = false;
  std::thread thread_;
};

}  // namespace dexcheck
