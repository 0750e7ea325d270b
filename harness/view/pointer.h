#pragma once

// What the mouse does in the scene: it pulls at bodies, and moves the camera.

#include <mujoco/mujoco.h>

#include <optional>

#include "controller/dynamics/model_terms.h"
#include "harness/engine/engine.h"
#include "harness/view/frame_source.h"
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

// The camera that the mouse moves, and that goes along with the object.

class ObjectCamera {
 public:
  /// @param source must outlive it. @param width, height of the picture, in pixels.
  ObjectCamera(const FrameSource& source, int width, int height);

  [[nodiscard]] const Viewpoint& view() const { return view_; }

  /// Looks at the robot and what it holds, at a row.
  void AimAt(long row);
  /// Near to the object.
  void AimAtObject(long row);
  /// The row is another one now. @param follow whether the camera goes along with the object.
  void Follow(long row, bool follow);
  /// The mouse has moved by so many pixels: turns about what it looks at, or moves in the picture's plane.
  void Turn(double x, double y);
  void Move(double x, double y);
  /// By notches of a wheel.
  void Zoom(double notches);
  /// The line of sight through a pixel.
  [[nodiscard]] Ray FindRay(double x, double y) const;

 private:
  /// Where the object is, or else the model's middle.
  [[nodiscard]] Vector3d FindObject(long row);

  const FrameSource& source_;
  int width_, height_;
  Viewpoint view_;
  Vector3d followed_ = Vector3d::Zero();  // where the object was
  MjDataPtr data_;
};

}  // namespace dexcheck
