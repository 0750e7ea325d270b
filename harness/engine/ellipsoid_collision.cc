#include "harness/engine/ellipsoid_collision.h"

#include <algorithm>
#include <cmath>
#include <mutex>

namespace dexcheck {
namespace {

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Halvings of an interval until its ends are neighbours.
constexpr int kMostHalvings = 200;

int CollideGeoms(const mjModel* m, const mjData* d, mjContact* con, int g1, int g2, mjtNum margin) {
  const Eigen::Map<const RowMatrix3d> R(d->geom_xmat + 9 * g2);
  const Eigen::Map<const Vector3d> origin(d->geom_xpos + 3 * g2);
  const Eigen::Map<const Vector3d> sphere(d->geom_xpos + 3 * g1);
  const Eigen::Map<const Vector3d> semi_axes(m->geom_size + 3 * g2);
  const SphereEllipsoidContact contact =
      CollideSphereEllipsoid(R.transpose() * (sphere - origin), m->geom_size[3 * g1], semi_axes);
  if (contact.distance > margin) return 0;
  con->dist = contact.distance;
  Eigen::Map<Vector3d>(con->pos) = origin + R * contact.position;
  Eigen::Map<Vector3d>(con->frame) = R * contact.normal;
  mju_zero3(con->frame + 3);
  return 1;
}

}  // namespace

SphereEllipsoidContact CollideSphereEllipsoid(const Vector3d& center, double sphere_radius,
                                              const Vector3d& semi_axes) {
  // The nearest point x has center - x = t D^-2 x, D = diag(semi_axes), so x_i = a_i^2 p_i / (a_i^2 + t) with
  //   f(t) = sum (a_i p_i / (a_i^2 + t))^2 - 1 = 0,  t > -min a_i^2,
  // which falls from infinity. Bisection knows no bad start.
  const auto evaluate = [&](double t) {
    double sum = -1.0;
    for (int i = 0; i < 3; ++i) {
      const double ratio = semi_axes[i] * center[i] / (semi_axes[i] * semi_axes[i] + t);
      sum += ratio * ratio;
    }
    return sum;
  };
  const double least = semi_axes.minCoeff();
  double low = -least * least;
  // At least one summand is 1 where another interval begins; none is more than 1 where this one ends.
  double high = semi_axes.maxCoeff() * center.norm();
  for (int i = 0; i < kMostHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    (evaluate(middle) > 0.0 ? low : high) = middle;
  }
  const double t = 0.5 * (low + high);
  Vector3d x;
  for (int i = 0; i < 3; ++i) {
    const double a2 = semi_axes[i] * semi_axes[i];
    x[i] = a2 * center[i] / (a2 + t);
  }
  const Vector3d outward = x.cwiseQuotient(semi_axes.cwiseAbs2()).normalized();
  SphereEllipsoidContact contact;
  contact.normal = -outward;
  contact.distance = outward.dot(center - x) - sphere_radius;
  contact.position = center + (sphere_radius + 0.5 * contact.distance) * contact.normal;
  return contact;
}

void InstallEllipsoidCollision() {
  static std::once_flag once;
  std::call_once(once, [] { mjCOLLISIONFUNC[mjGEOM_SPHERE][mjGEOM_ELLIPSOID] = CollideGeoms; });
}

}  // namespace dexcheck
