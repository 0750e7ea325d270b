#include "harness/engine/torus_collision.h"

#include <cmath>
#include <mutex>
#include <utility>

#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

mjfCollision original_sphere_mesh = nullptr;
mjfCollision original_box_mesh = nullptr;

/// Tilt of a torus that lies flat, rad.
constexpr double kLyingFlat = 1e-3;

/// Pose of the body, which is a torus's frame: the engine turns a mesh geom's own frame to the mesh's
/// principal axes.
Pose GeomPose(const mjModel& m, const mjData& d, int geom) {
  const int body = m.geom_bodyid[geom];
  Pose X = Pose::Identity();
  X.linear() = Eigen::Map<const RowMatrix3d>(d.xmat + 9 * body);
  X.translation() = Eigen::Map<const Vector3d>(d.xpos + 3 * body);
  return X;
}

/// @param X where the contact's numbers stand in the world.
template <typename Contact>
void PlaceContact(const Pose& X, const Contact& contact, CollisionContact* found) {
  const Vector3d position = X * contact.position;
  const Vector3d normal = X.linear() * contact.normal;
  FillContact(contact.distance, position.data(), normal.data(), found);
}

int CollideSphereMesh(const mjModel* m, CollisionData* d, CollisionContact* con, int g1, int g2,
                      mjtNum margin) {
  double ring_radius = 0.0;
  double tube_radius = 0.0;
  if (!GetTorusRadii(*m, g2, &ring_radius, &tube_radius))
    return original_sphere_mesh(m, d, con, g1, g2, margin);

  const Pose X_BT = GeomPose(*m, *d, g2);
  const Eigen::Map<const Vector3d> sphere(d->geom_xpos + 3 * g1);
  const Vector3d center = X_BT.linear().transpose() * (sphere - X_BT.translation());
  SphereTorusContact contacts[2];
  const int count =
      CollideSphereTorus(center, m->geom_size[3 * g1], ring_radius, tube_radius, margin, contacts);
  for (int i = 0; i < count; ++i) {
    PlaceContact(X_BT, contacts[i], con + i);
  }
  return count;
}

int CollideBoxMesh(const mjModel* m, CollisionData* d, CollisionContact* con, int g1, int g2, mjtNum margin) {
  double ring_radius = 0.0;
  double tube_radius = 0.0;
  if (!GetTorusRadii(*m, g2, &ring_radius, &tube_radius)) return original_box_mesh(m, d, con, g1, g2, margin);
  Pose X_WB = Pose::Identity();
  X_WB.linear() = Eigen::Map<const RowMatrix3d>(d->geom_xmat + 9 * g1);
  X_WB.translation() = Eigen::Map<const Vector3d>(d->geom_xpos + 3 * g1);
  const Eigen::Map<const Vector3d> half_size(m->geom_size + 3 * g1);
  BoxTorusContact contacts[kRingPlaces];
  const Pose X_BT = X_WB.inverse(Eigen::Isometry) * GeomPose(*m, *d, g2);
  const int count = CollideBoxTorus(X_BT, ring_radius, tube_radius, half_size, margin, contacts);
  for (int i = 0; i < count; ++i) {
    PlaceContact(X_WB, contacts[i], con + i);
  }
  return count;
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

bool GetTorusRadii(const mjModel& model, int geom, double* ring_radius, double* tube_radius) {
  if (model.nuser_geom < 2 || model.geom_type[geom] != mjGEOM_MESH) return false;
  const mjtNum* user = model.geom_user + model.nuser_geom * geom;
  *ring_radius = user[0];
  *tube_radius = user[1];
  return user[0] > user[1] && user[1] > 0.0;
}

int CollideSphereTorus(const Vector3d& center, double sphere_radius, double ring_radius, double tube_radius,
                       double margin, SphereTorusContact contacts[2]) {
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
    SphereTorusContact& contact = contacts[count++];
    contact.distance = distance;
    contact.normal = apart > 0.0 ? Vector3d(-offset / apart) : Vector3d(-side * outward);
    contact.position = center + (sphere_radius + 0.5 * distance) * contact.normal;
  }
  if (count == 2 && contacts[1].distance < contacts[0].distance) std::swap(contacts[0], contacts[1]);
  return count;
}

int CollideBoxTorus(const Pose& X_BT, double ring_radius, double tube_radius, const Vector3d& half_size,
                    double margin, BoxTorusContact contacts[kRingPlaces]) {
  Vector3d normal;
  MeasureBox(X_BT.translation(), half_size, &normal);
  const Vector3d down = -(X_BT.linear().transpose() * normal);
  const double first = down.head<2>().norm() > kLyingFlat ? std::atan2(down.y(), down.x()) : 0.0;
  int count = 0;
  for (int i = 0; i < kRingPlaces; ++i) {
    const double u = first + 2.0 * kPi * i / kRingPlaces;
    const Vector3d center = X_BT * Vector3d(ring_radius * std::cos(u), ring_radius * std::sin(u), 0.0);
    const double distance = MeasureBox(center, half_size, &normal) - tube_radius;
    if (distance > margin) continue;
    contacts[count++] = {distance, normal, center - (tube_radius + 0.5 * distance) * normal};
  }
  return count;
}

void InstallTorusCollision() {
  static std::once_flag once;
  std::call_once(once, [] {
    original_sphere_mesh = mjCOLLISIONFUNC[mjGEOM_SPHERE][mjGEOM_MESH];
    mjCOLLISIONFUNC[mjGEOM_SPHERE][mjGEOM_MESH] = CollideSphereMesh;
    original_box_mesh = mjCOLLISIONFUNC[mjGEOM_BOX][mjGEOM_MESH];
    mjCOLLISIONFUNC[mjGEOM_BOX][mjGEOM_MESH] = CollideBoxMesh;
  });
}

}  // namespace dexcheck
