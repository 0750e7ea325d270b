#include "harness/engine/ellipsoid_collision.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "harness/engine/sphere_collision.h"

namespace dexcheck {
namespace {

int CollideEllipsoidGeom(const mjModel* m, CollisionData* d, CollisionContact* con, int g1, int g2,
                         mjtNum margin) {
  const auto collide = [&](const Vector3d& center, double radius, const Vector3d& semi_axes) {
    // Out of reach the nearest point need not be found.
    if (center.norm() > semi_axes.maxCoeff() + radius + margin) {
      return SphereEllipsoidContact{std::numeric_limits<double>::infinity(), Vector3d::Zero(),
                                    Vector3d::Zero()};
    }
    return CollideSphereEllipsoid(center, radius, semi_axes);
  };
  return CollideSphereGeom(*m, *d, g1, g2, margin, collide, con);
}

}  // namespace

SphereEllipsoidContact CollideSphereEllipsoid(const Vector3d& center, double sphere_radius,
                                              const Vector3d& semi_axes) {
  // The nearest point x has p - x = t grad, so x_i = a_i^2 p_i / (a_i^2 + t) with sum (x_i / a_i)^2 = 1. The
  // sum falls from infinity at t = -a_min^2; halving finds where it is 1, to the last bit. In s = t +
  // a_min^2.
  const Vector3d a2 = semi_axes.array().square();
  const Vector3d beyond = a2.array() - a2.minCoeff();
  const Vector3d weighted = semi_axes.cwiseProduct(center.cwiseAbs());
  const auto excess = [&](double s) {
    double sum = -1.0;
    for (int i = 0; i < 3; ++i) {
      if (weighted[i] == 0.0) continue;
      const double ratio = weighted[i] / (s + beyond[i]);
      sum += ratio * ratio;
    }
    return sum;
  };
  double low = 0.0;
  double high = weighted.norm();
  while (true) {
    const double middle = 0.5 * (low + high);
    if (!(middle > low && middle < high)) break;
    (excess(middle) > 0.0 ? low : high) = middle;
  }
  Vector3d on_sphere;  // x_i / a_i
  for (int i = 0; i < 3; ++i) {
    on_sphere[i] = weighted[i] == 0.0 ? 0.0 : std::copysign(weighted[i] / (high + beyond[i]), center[i]);
  }
  const double left = 1.0 - on_sphere.squaredNorm();
  if (left > 1e-8) {
    // In the plane of the longer axes: the shortest one's part is what is left.
    Eigen::Index shortest = 0;
    a2.minCoeff(&shortest);
    on_sphere[shortest] = std::sqrt(left);
  }
  on_sphere.normalize();
  const Vector3d outward = on_sphere.cwiseQuotient(semi_axes).normalized();
  SphereEllipsoidContact contact;
  contact.normal = -outward;
  contact.distance = outward.dot(center - semi_axes.cwiseProduct(on_sphere)) - sphere_radius;
  contact.position = center + (sphere_radius + 0.5 * contact.distance) * contact.normal;
  return contact;
}

void InstallEllipsoidCollision() {
  static std::once_flag once;
  std::call_once(once, [] { mjCOLLISIONFUNC[mjGEOM_SPHERE][mjGEOM_ELLIPSOID] = CollideEllipsoidGeom; });
}

}  // namespace dexcheck
