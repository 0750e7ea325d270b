#pragma once

// Exact contact between spheres and ellipsoids. The engine collides this pair by a general method for convex
// bodies that stops at about 1e-6 of a length, where a contact frame is compared to rounding.

#include <mujoco/mujoco.h>

#include "controller/common/types.h"

namespace dexcheck {

/// Sphere against ellipsoid.
struct SphereEllipsoidContact {
  double distance;    ///< Between the surfaces, m; negative when they overlap.
  Vector3d normal;    ///< From the sphere to the ellipsoid, in the ellipsoid's frame.
  Vector3d position;  ///< Midway between the surfaces, in the ellipsoid's frame, m.
};

/// The nearest points of a sphere and an ellipsoid, whose axes are those of its frame. Of a centre in the
/// middle the nearest point is on the shortest axis.
/// @param center of the sphere in the ellipsoid's frame, m.
SphereEllipsoidContact CollideSphereEllipsoid(const Vector3d& center, double sphere_radius,
                                              const Vector3d& semi_axes);

/// Makes the engine collide spheres with ellipsoids so, in the whole process. Safe to call more than once and
/// from several threads.
void InstallEllipsoidCollision();

}  // namespace dexcheck
