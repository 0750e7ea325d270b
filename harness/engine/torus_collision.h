#pragma once

// Exact contact between spheres and tori. The engine collides a mesh as its convex hull, which fills a
// torus's hole; this narrow phase replaces that for mesh geoms marked as tori.

#include <mujoco/mujoco.h>

#include "controller/common/types.h"

namespace dexcheck {

/// Sphere against torus at one place. A sphere near the axis can touch the tube on both sides of the hole.
struct SphereTorusContact {
  double distance;    ///< Between the surfaces, m; negative when they overlap.
  Vector3d normal;    ///< From the sphere to the tube, in the torus's frame.
  Vector3d position;  ///< Midway between the surfaces, in the torus's frame, m.
};

/// Contacts nearer than `margin` between a sphere and a torus about the z axis of its frame, nearest first.
/// @param center of the sphere in the torus's frame, m.
/// @return how many of `contacts` (at most two) were filled.
int CollideSphereTorus(const Vector3d& center, double sphere_radius, double ring_radius, double tube_radius,
                       double margin, SphereTorusContact contacts[2]);

/// Makes the engine collide spheres with tori exactly, in the whole process; other meshes keep the engine's
/// own function. A mesh geom is a torus about its BODY's origin and z axis when the MJCF gives it
/// user="RING_RADIUS TUBE_RADIUS" (with <size nuser_geom="2"/>). Safe to call more than once and from several
/// threads.
void InstallTorusCollision();

/// Ring and tube radius of a geom marked as a torus; false for all others.
bool GetTorusRadii(const mjModel& model, int geom, double* ring_radius, double* tube_radius);

}  // namespace dexcheck
