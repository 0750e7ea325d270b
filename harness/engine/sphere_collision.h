#pragma once

// What collision functions between a sphere and a geom of another shape share: from the engine's arrays to
// the geom's own frame, where the shape is simple, and back.

#include <mujoco/mujoco.h>

#include "controller/common/types.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {

/// Collides the sphere g1 with the geom g2 and returns the number of contacts, 0 or 1.
/// @param collide (center of the sphere in the geom's frame, m; the sphere's radius, m; the geom's three
///   sizes) -> {distance, normal, position} in the geom's frame, with the normal from sphere to geom.
/// @param margin largest distance of a contact, m.
/// @param found the contact, in the world.
template <typename Collide>
int CollideSphereGeom(const mjModel& m, const mjData& d, int g1, int g2, mjtNum margin,
                      const Collide& collide, CollisionContact* found) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(d.geom_xmat + 9 * g2);
  const Eigen::Map<const Vector3d> origin(d.geom_xpos + 3 * g2);
  const Eigen::Map<const Vector3d> sphere(d.geom_xpos + 3 * g1);
  const Eigen::Map<const Vector3d> size(m.geom_size + 3 * g2);
  const auto contact = collide(R.transpose() * (sphere - origin), m.geom_size[3 * g1], size);
  if (contact.distance > margin) return 0;
  const Vector3d position = origin + R * contact.position;
  const Vector3d normal = R * contact.normal;
  FillContact(contact.distance, position.data(), normal.data(), found);
  return 1;
}

}  // namespace dexcheck
