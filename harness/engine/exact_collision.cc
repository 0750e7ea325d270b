#include "harness/engine/exact_collision.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <span>
#include <utility>

#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

mjfCollision original_sphere_mesh = nullptr;
mjfCollision original_box_mesh = nullptr;

/// Tilt of a torus that lies flat, rad.
constexpr double kLyingFlat = 1e-3;

/// Pose of the body, which is a torus's frame: the engine turns a mesh geom's own frame to the mesh's
/// principal axes.
Pose TorusPose(const mjModel& m, const mjData& d, int geom) { return BodyPose(d, m.geom_bodyid[geom]); }

/// Fills the engine's contacts. @param X frame of the contacts' numbers in the world. @return how many they
/// are.
int PlaceContacts(const Pose& X, std::span<const ExactContact> contacts, CollisionContact* found) {
  for (const ExactContact& contact : contacts) {
    const Vector3d position = X * contact.position;
    const Vector3d normal = X.linear() * contact.normal;
    FillContact(contact.distance, position.data(), normal.data(), found++);
  }
  return static_cast<int>(contacts.size());
}

/// Collides the sphere g1 with the geom g2 in the geom's frame. @return the number of contacts, 0 or 1.
/// @param collide (center of the sphere in the geom's frame, m; the sphere's radius, m; the geom's sizes).
template <typename Collide>
int CollideSphereGeom(const mjModel& m, const mjData& d, int g1, int g2, mjtNum margin,
                      const Collide& collide, CollisionContact* found) {
  const RotationMap R(d.geom_xmat + 9 * g2);
  const Vector3d origin = MapVector(d.geom_xpos + 3 * g2);
  const Vector3d center = R.transpose() * (MapVector(d.geom_xpos + 3 * g1) - origin);
  const ExactContact contact = collide(center, m.geom_size[3 * g1], MapVector(m.geom_size + 3 * g2));
  if (contact.distance > margin) return 0;
  const Vector3d position = origin + R * contact.position;
  const Vector3d normal = R * contact.normal;
  FillContact(contact.distance, position.data(), normal.data(), found);
  return 1;
}

int CollideCylinderGeom(const mjModel* m, CollisionData* d, CollisionContact* con, int g1, int g2,
                        mjtNum margin) {
  const auto collide = [](const Vector3d& center, double radius, const Vector3d& size) {
    return CollideSphereCylinder(center, radius, size[0], size[1]);
  };
  return CollideSphereGeom(*m, *d, g1, g2, margin, collide, con);
}

int CollideEllipsoidGeom(const mjModel* m, CollisionData* d, CollisionContact* con, int g1, int g2,
                         mjtNum margin) {
  const auto collide = [&](const Vector3d& center, double radius, const Vector3d& semi_axes) {
    // The nearest point need not be found out of reach.
    if (center.norm() > semi_axes.maxCoeff() + radius + margin) return ExactContact{};
    return CollideSphereEllipsoid(center, radius, semi_axes);
  };
  return CollideSphereGeom(*m, *d, g1, g2, margin, collide, con);
}

int CollideSphereMesh(const mjModel* m, CollisionData* d, CollisionContact* con, int g1, int g2,
                      mjtNum margin) {
  double ring_radius = 0.0;
  double tube_radius = 0.0;
  if (!GetTorusRadii(*m, g2, &ring_radius, &tube_radius))
    return original_sphere_mesh(m, d, con, g1, g2, margin);

  const Pose X_BT = TorusPose(*m, *d, g2);
  const Eigen::Map<const Vector3d> sphere(d->geom_xpos + 3 * g1);
  const Vector3d center = X_BT.linear().transpose() * (sphere - X_BT.translation());
  ExactContact contacts[2];
  int count = CollideSphereTorus(center, m->geom_size[3 * g1], ring_radius, tube_radius, margin, contacts);
  count = std::min(count, CountMostContacts(*m, g1, g2, margin));  // the deeper one is the first
  return PlaceContacts(X_BT, {contacts, static_cast<size_t>(count)}, con);
}

int CollideBoxMesh(const mjModel* m, CollisionData* d, CollisionContact* con, int g1, int g2, mjtNum margin) {
  double ring_radius = 0.0;
  double tube_radius = 0.0;
  if (!GetTorusRadii(*m, g2, &ring_radius, &tube_radius)) return original_box_mesh(m, d, con, g1, g2, margin);
  const Pose X_WB = MapPose(d->geom_xmat + 9 * g1, d->geom_xpos + 3 * g1);
  const Eigen::Map<const Vector3d> half_size(m->geom_size + 3 * g1);
  ExactContact contacts[kRingPlaces];
  const Pose X_BT = X_WB.inverse(Eigen::Isometry) * TorusPose(*m, *d, g2);
  const int places = std::min(kRingPlaces, CountMostContacts(*m, g1, g2, margin));
  const int count = CollideBoxTorus(X_BT, ring_radius, tube_radius, half_size, margin, contacts, places);
  return PlaceContacts(X_WB, {contacts, static_cast<size_t>(count)}, con);
}

/// Distance of a point from a box's surface, negative inside, and the outward normal there.
double MeasureBox(const Vector3d& point, const Vector3d& half_size, Vector3d* normal) {
  const Vector3d beyond = point - point.cwiseMax(-half_size).cwiseMin(half_size);
  const double outside = beyond.norm();
  if (outside > 0.0) {
    *normal = beyond / outside;
    return outside;
  }
  Eigen::Index axis = 0;
  const double inside = (point.cwiseAbs() - half_size).maxCoeff(&axis);
  *normal = (point[axis] < 0.0 ? -1.0 : 1.0) * Vector3d::Unit(axis);
  return inside;
}

}  // namespace

ExactContact CollideSphereCylinder(const Vector3d& center, double sphere_radius, double cylinder_radius,
                                   double half_length) {
  const double rho = center.head<2>().norm();
  const Vector3d outward = rho > 0.0 ? Vector3d(center.x() / rho, center.y() / rho, 0.0) : Vector3d::UnitX();
  const Vector3d along = center.z() < 0.0 ? Vector3d(-Vector3d::UnitZ()) : Vector3d::UnitZ();
  const double beyond_side = rho - cylinder_radius;
  const double beyond_end = std::abs(center.z()) - half_length;
  ExactContact contact;
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

ExactContact CollideSphereEllipsoid(const Vector3d& center, double sphere_radius, const Vector3d& semi_axes) {
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
    // The problem in the plane of the longer axes: the rest is the part of the shortest one.
    Eigen::Index shortest = 0;
    a2.minCoeff(&shortest);
    on_sphere[shortest] = std::sqrt(left);
  }
  on_sphere.normalize();
  const Vector3d outward = on_sphere.cwiseQuotient(semi_axes).normalized();
  ExactContact contact;
  contact.normal = -outward;
  contact.distance = outward.dot(center - semi_axes.cwiseProduct(on_sphere)) - sphere_radius;
  contact.position = center + (sphere_radius + 0.5 * contact.distance) * contact.normal;
  return contact;
}

bool GetTorusRadii(const mjModel& model, int geom, double* ring_radius, double* tube_radius) {
  if (model.nuser_geom < 2 || model.geom_type[geom] != mjGEOM_MESH) return false;
  const mjtNum* user = model.geom_user + model.nuser_geom * geom;
  *ring_radius = user[0];
  *tube_radius = user[1];
  return user[0] > user[1] && user[1] > 0.0;
}

int CollideSphereTorus(const Vector3d& center, double sphere_radius, double ring_radius, double tube_radius,
                       double margin, ExactContact contacts[2]) {
  // The ring's point nearest to the sphere lies in the half plane of the sphere's centre, the other one
  // opposite.
  const double rho = std::hypot(center.x(), center.y());
  const Vector3d outward = rho > 0.0 ? Vector3d(center.x() / rho, center.y() / rho, 0.0) : Vector3d::UnitX();
  int count = 0;
  for (const double side : {1.0, -1.0}) {
    const Vector3d ring_point = side * ring_radius * outward;
    const Vector3d offset = center - ring_point;
    const double apart = offset.norm();
    const double distance = apart - tube_radius - sphere_radius;
    if (distance > margin) continue;
    ExactContact& contact = contacts[count++];
    contact.distance = distance;
    contact.normal = apart > 0.0 ? Vector3d(-offset / apart) : Vector3d(-side * outward);
    contact.position = center + (sphere_radius + 0.5 * distance) * contact.normal;
  }
  if (count == 2 && contacts[1].distance < contacts[0].distance) std::swap(contacts[0], contacts[1]);
  return count;
}

int CollideBoxTorus(const Pose& X_BT, double ring_radius, double tube_radius, const Vector3d& half_size,
                    double margin, ExactContact contacts[], int places) {
  Vector3d normal;
  MeasureBox(X_BT.translation(), half_size, &normal);
  const Vector3d down = -(X_BT.linear().transpose() * normal);
  const double first = down.head<2>().norm() > kLyingFlat ? std::atan2(down.y(), down.x()) : 0.0;
  int count = 0;
  for (int i = 0; i < places; ++i) {
    const double u = first + 2.0 * kPi * i / places;
    const Vector3d center = X_BT * Vector3d(ring_radius * std::cos(u), ring_radius * std::sin(u), 0.0);
    const double distance = MeasureBox(center, half_size, &normal) - tube_radius;
    if (distance > margin) continue;
    contacts[count++] = {distance, normal, center - (tube_radius + 0.5 * distance) * normal};
  }
  return count;
}

void InstallExactCollision() {
  static std::once_flag once;
  std::call_once(once, [] {
    mjCOLLISIONFUNC[mjGEOM_SPHERE][mjGEOM_CYLINDER] = CollideCylinderGeom;
    mjCOLLISIONFUNC[mjGEOM_SPHERE][mjGEOM_ELLIPSOID] = CollideEllipsoidGeom;
    original_sphere_mesh = std::exchange(mjCOLLISIONFUNC[mjGEOM_SPHERE][mjGEOM_MESH], CollideSphereMesh);
    original_box_mesh = std::exchange(mjCOLLISIONFUNC[mjGEOM_BOX][mjGEOM_MESH], CollideBoxMesh);
  });
}

}  // namespace dexcheck
