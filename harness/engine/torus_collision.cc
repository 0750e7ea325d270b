#include "harness/engine/torus_collision.h"

#include <cmath>
#include <mutex>
#include <utility>

namespace dexcheck {
namespace {

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

mjfCollision original_sphere_mesh = nullptr;

int CollideSphereMesh(const mjModel* m, const mjData* d, mjContact* con, int g1, int g2, mjtNum margin) {
  double ring_radius = 0.0;
  double tube_radius = 0.0;
  if (!GetTorusRadii(*m, g2, &ring_radius, &tube_radius))
    return original_sphere_mesh(m, d, con, g1, g2, margin);

  // The frame is the body's: the engine turns a mesh geom's own frame to the mesh's principal axes.
  const int body = m->geom_bodyid[g2];
  const Eigen::Map<const RowMatrix3d> R(d->xmat + 9 * body);
  const Eigen::Map<const Vector3d> origin(d->xpos + 3 * body);
  const Eigen::Map<const Vector3d> sphere(d->geom_xpos + 3 * g1);
  const Vector3d center = R.transpose() * (sphere - origin);
  SphereTorusContact contacts[2];
  const int count =
      CollideSphereTorus(center, m->geom_size[3 * g1], ring_radius, tube_radius, margin, contacts);
  for (int i = 0; i < count; ++i) {
    con[i].dist = contacts[i].distance;
    Eigen::Map<Vector3d>(con[i].pos) = origin + R * contacts[i].position;
    Eigen::Map<Vector3d>(con[i].frame) = R * contacts[i].normal;
    mju_zero3(con[i].frame + 3);
  }
  return count;
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

void InstallTorusCollision() {
  static std::once_flag once;
  std::call_once(once, [] {
    original_sphere_mesh = mjCOLLISIONFUNC[mjGEOM_SPHERE][mjGEOM_MESH];
    mjCOLLISIONFUNC[mjGEOM_SPHERE][mjGEOM_MESH] = CollideSphereMesh;
  });
}

}  // namespace dexcheck
