#pragma once

// The camera that the mouse moves, and that goes along with the object.

#include "harness/engine/engine.h"
#include "harness/view/frame_source.h"
#include "harness/view/mouse_force.h"
#include "renders/viewpoint.h"

namespace dexcheck {

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
