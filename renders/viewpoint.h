#pragma once

// Where to stand so that all of something is in the picture.

#include <span>

#include "controller/common/types.h"

namespace dexcheck {

/// A camera that stands still, as the engine's free camera: it looks along
/// f = (cos(elevation) cos(azimuth), cos(elevation) sin(azimuth), sin(elevation)), the world's z upwards.
struct Viewpoint {
  Vector3d look_at = Vector3d::Zero();  ///< World, m.
  double distance = 1.0;                ///< From the camera to look_at, m.
  double azimuth = 0.0;                 ///< rad.
  double elevation = 0.0;               ///< rad; negative looks down.
};

/// From one point to another. @throws std::invalid_argument when they are the same.
Viewpoint LookFrom(const Vector3d& eye, const Vector3d& look_at);

/// What must be in the picture.
struct VisibleSphere {
  Vector3d center;  ///< World, m.
  double radius;    ///< m.
};

/// Where in the picture: tangents of the angles between the camera's axis and the edges, positive.
struct ViewEdges {
  double left, right, bottom, top;
};

/// The nearest viewpoint with these angles from which all spheres lie between the edges; in the direction
/// that is not filled they are in the middle.
/// @throws std::invalid_argument when there is no sphere.
Viewpoint FitViewpoint(std::span<const VisibleSphere> spheres, double azimuth, double elevation,
                       const ViewEdges& edges);

}  // namespace dexcheck
