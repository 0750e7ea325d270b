#include "harness/engine/cylinder_collision.h"

#include <cmath>
#include <mutex>

#include "harness/engine/sphere_collision.h"

namespace dexcheck {
namespace {

int CollideCylinderGeom(const mjModel* m, CollisionData* d, CollisionContact* con, int g1, int g2,
                        mjtNum margin) {
  const auto collide = [](const Vector3d& center, double radius, const Vector3d& size) {
    return CollideSphereCylinder(center, radius, size[0], size[1]);
  };
  return CollideSphereGeom(*m, *d, g1, g2, margin, collide, con);
}

}  // namespace

SphereCylinderContact CollideSphereCylinder(const Vector3d& center, double sphere_radius,
                                            double cylinder_radius, double half_length) {
  const double rho = center.head<2>().norm();
  const Vector3d outward = rho > 0.0 ? Vector3d(center.x() / rho, center.y() / rho, 0.0) : Vector3d::UnitX();
  const Vector3d along = center.z() < 0.0 ? Vector3d(-Vector3d::UnitZ()) : Vector3d::UnitZ();
  const double beyond_side = rho - cylinder_radius;
  const double beyond_end = std::abs(center.z()) - half_length;
  SphereCylinderContact contact;
  if (beyond_side > 0.0 && beyond_end > 0.0) {
    const double apart = std::hypot(beyond_side, beyond_end);
    contact.normal = -(beyond_side * outward + beyond_end * along) / apart;
    contact.distance = apart - sphere_radius;
  } else if (beyond_side > beyond_end) {
    contact.normal = -outward;
    contact.distance = beyond_side - sphere_radius;
  } else {
    contact.normal = -along;
    contact.distance = beyond_end - sphere_radius;
  }
  contact.position = center + (sphere_radius + 0.5 * contact.distance) * contact.normal;
  return contact;
}

void InstallCylinderCollision() {
  static std::once_flag once;
  std::call_once(once, [] { mjCOLLISIONFUNC[mjGEOM_SPHERE][mjGEOM_CYLINDER] = CollideCylinderGeom; });
}

}  // namespace dexcheck
