#pragma once

// Pulling with the mouse: what is under it, and with which force it is pulled.

#include <mujoco/mujoco.h>

#include <optional>

#include "controller/dynamics/model_terms.h"
#include "harness/engine/engine.h"
#include "harness/view/live_run.h"
#include "renders/viewpoint.h"

namespace dexcheck {

/// A line of sight in the world.
struct Ray {
  Vector3d from;
  Vector3d along;  ///< Unit vector.
};

/// Through a point of a picture that a camera which stands at `view` makes.
/// @param x, y from the picture's middle to the right and upwards, in halves of its height.
/// @param fovy whole angle from the picture's lower to its upper edge, rad.
Ray CalcRay(const Viewpoint& view, double fovy, double x, double y);

/// Pulls at a point of a body towards the mouse, as a spring does.
class MouseSpring {
 public:
  /// Takes hold of what the ray meets first. None when that is neither the object nor a link.
  /// @param looks the model as it is seen, with the bodies of the setup's.
  static std::optional<MouseSpring> Grab(const Setup& setup, const mjModel& looks, const ViewFrame& frame,
                                         const Ray& ray);

  /// The pull when the mouse is on this ray and the run at this frame.
  [[nodiscard]] MouseForce Find(const ViewFrame& frame, const Ray& ray) const;
  /// The point that is pulled, m, world.
  [[nodiscard]] Vector3d FindPoint(const ViewFrame& frame) const;

 private:
  MouseSpring(const Setup& setup, int link, const Vector3d& at, double stiffness)
      : setup_(&setup), link_(link), at_(at), stiffness_(stiffness) {}
  [[nodiscard]] Pose FindPose(const ViewFrame& frame) const;

  const Setup* setup_;
  int link_;  // its joint, -1 the base, Wrench::kObject the object
  Vector3d at_;
  double stiffness_;  // N/m
};

}  // namespace dexcheck
