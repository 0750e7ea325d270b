#pragma once

// Exact contact of spheres with cylinders, ellipsoids and tori, and of boxes with tori. The engine collides
// spheres with cylinders and ellipsoids by a general method for convex bodies that stops at about 1e-6 of a
// length, while contact frames are compared to rounding. Meshes collide as convex hulls, without a hole.

#include <mujoco/mujoco.h>

#include <limits>

#include "controller/common/types.h"

namespace dexcheck {

/// One pair of nearest points of two surfaces, in the frame that a function names.
struct ExactContact {
  double distance = std::numeric_limits<double>::infinity();  ///< m; negative when they overlap.
  Vector3d normal = Vector3d::Zero();                         ///< From the sphere, or the box, to the other.
  Vector3d position = Vector3d::Zero();                       ///< Midway between the surfaces, m.
};

/// Calculates the nearest points of a sphere and a cylinder about the z axis of its frame: on the side, on an
/// end, or on the rim between them. For a centre inside the cylinder the nearer of side and end counts; for a
/// centre on the axis the side's point lies along x.
/// @param center of the sphere in the cylinder's frame, m. @return in the cylinder's frame.
ExactContact CollideSphereCylinder(const Vector3d& center, double sphere_radius, double cylinder_radius,
                                   double half_length);

/// Calculates the nearest points of a sphere and an ellipsoid, whose axes are those of its frame. For a
/// centre in the middle the nearest point is on the shortest axis.
/// @param center of the sphere in the ellipsoid's frame, m. @return in the ellipsoid's frame.
ExactContact CollideSphereEllipsoid(const Vector3d& center, double sphere_radius, const Vector3d& semi_axes);

/// Calculates the contacts nearer than `margin` between a sphere and a torus about the z axis of its frame,
/// nearest first: a sphere near the axis can touch the tube on both sides of the hole.
/// @param center of the sphere in the torus's frame, m.
/// @return how many of `contacts` (at most two; in the torus's frame) were filled.
int CollideSphereTorus(const Vector3d& center, double sphere_radius, double ring_radius, double tube_radius,
                       double margin, ExactContact contacts[2]);

/// Number of places of the ring at which a torus is collided with a box; fewer where the engine has less room
/// (MuJoCo 3.8 and newer: 4, or 5 with a margin).
inline constexpr int kRingPlaces = 8;

/// Calculates the contacts nearer than `margin` between a torus and a box. A torus is a ball rolled around
/// its ring: the ball is collided at `places`, evenly spread from the place that is deepest in the box, or
/// from the torus's x axis when it lies so flat that there is none. The result is exact for a torus on a
/// face; an edge or corner between two places is missed.
/// @param X_BT the torus, about its z axis, in the box's frame. @param half_size of the box, m.
/// @return how many of `contacts` (in the box's frame) were filled.
int CollideBoxTorus(const Pose& X_BT, double ring_radius, double tube_radius, const Vector3d& half_size,
                    double margin, ExactContact contacts[], int places = kRingPlaces);

/// Makes the engine collide in this way in the whole process; meshes that are no tori keep the engine's own
/// functions. A mesh geom is a torus about its BODY's origin and z axis when the MJCF gives it
/// user="RING_RADIUS TUBE_RADIUS" (with nuser_geom="2" in `size`). May be called repeatedly, from any thread.
void InstallExactCollision();

/// Ring and tube radius of a geom marked as a torus; false for all others.
bool GetTorusRadii(const mjModel& model, int geom, double* ring_radius, double* tube_radius);

}  // namespace dexcheck
