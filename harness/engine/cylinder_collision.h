#pragma once

// Exact contact between spheres and cylinders. The engine collides this pair by a general method for convex
// bodies that stops at about 1e-6 of a length, where a contact frame is compared to rounding.

#include <mujoco/mujoco.h>

#include "controller/common/types.h"

namespace dexcheck {

/// Sphere against cylinder.
struct SphereCylinderContact {
  double distance;    ///< Between the surfaces, m; negative when they overlap.
  Vector3d normal;    ///< From the sphere to the cylinder, in the cylinder's frame.
  Vector3d position;  ///< Midway between the surfaces, in the cylinder's frame, m.
};

/// The nearest points of a sphere and a cylinder about the z axis of its frame: on the side, on an end, or on
/// the rim between them. Of a centre inside the cylinder the nearer of side and end counts; on the axis the
/// side is met along x.
/// @param center of the sphere in the cylinder's frame, m.
SphereCylinderContact CollideSphereCylinder(const Vector3d& center, double sphere_radius,
                                            double cylinder_radius, double half_length);

/// Makes the engine collide spheres with cylinders so, in the whole process. Safe to call more than once and
/// from several threads.
void InstallCylinderCollision();

}  // namespace dexcheck
