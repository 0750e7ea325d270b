#include "harness/engine/solid.h"

#include <algorithm>
#include <limits>

#include "harness/engine/engine.h"
#include "harness/engine/exact_collision.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

/// MJCFs keep the geoms that collide in this group, which viewers do not show.
constexpr int kCollisionGroup = 3;

/// @return how far its vertices reach, m.
double ReadHull(const mjModel& m, int geom, Solid* solid) {
  const int mesh = m.geom_dataid[geom];
  const float* const first = m.mesh_vert + 3 * m.mesh_vertadr[mesh];
  // The engine's hull of a mesh that collides: how many vertices and faces, where their edges are, and which.
  const int* const hull = m.mesh_graphadr[mesh] < 0 ? nullptr : m.mesh_graph + m.mesh_graphadr[mesh];
  const int count = hull == nullptr ? m.mesh_vertnum[mesh] : hull[0];
  double reach = 0.0;
  for (int i = 0; i < count; ++i) {
    const int vertex = hull == nullptr ? i : hull[2 + count + i];
    solid->vertices.push_back(Eigen::Map<const Eigen::Vector3f>(first + 3 * vertex).cast<double>());
    reach = std::max(reach, solid->vertices.back().norm());
  }
  return reach;
}

/// Reads the shape of a geom; false for a geom without a shape here.
bool ReadShape(const mjModel& m, int geom, Solid* solid) {
  using enum Solid::Shape;
  const Vector3d& size = solid->size;
  const auto take = [&](Solid::Shape shape, double reach) {
    solid->shape = shape;
    solid->reach = reach;
    return true;
  };
  double ring = 0.0;
  double tube = 0.0;
  switch (m.geom_type[geom]) {
    case mjGEOM_PLANE:
      return take(kPlane, std::numeric_limits<double>::infinity());
    case mjGEOM_SPHERE:
      return take(kSphere, size[0]);
    case mjGEOM_CAPSULE:
      return take(kCapsule, size[0] + size[1]);
    case mjGEOM_CYLINDER:
      return take(kCylinder, size.head<2>().norm());
    case mjGEOM_ELLIPSOID:
      return take(kEllipsoid, size.maxCoeff());
    case mjGEOM_BOX:
      return take(kBox, size.norm());
    case mjGEOM_MESH:
      if (!GetTorusRadii(m, geom, &ring, &tube)) return take(kHull, ReadHull(m, geom, solid));
      // About the body's own axis; see InstallExactCollision.
      solid->X_BG = Pose::Identity();
      solid->size = Vector3d(ring, tube, 0.0);
      return take(kTorus, ring + tube);
    default:
      return false;
  }
}

/// Whether a geom is only visible: one outside the collision group in a body that has such geoms, or a mesh
/// without contacts in a body whose other geoms have some.
bool IsLooks(const mjModel& m, int geom) {
  const int body = m.geom_bodyid[geom], first = m.body_geomadr[body];
  const auto any = [&](const auto& is) {
    bool is_any = false;
    for (int g = first; g < first + m.body_geomnum[body]; ++g) is_any |= is(g);
    return is_any;
  };
  const auto touches = [&](int g) { return CanTouch(m, g); };
  if (any([&](int g) { return m.geom_group[g] == kCollisionGroup; }))
    return m.geom_group[geom] != kCollisionGroup;
  return m.geom_type[geom] == mjGEOM_MESH && !touches(geom) && any(touches);
}

}  // namespace

Solids ListSolids(const mjModel& m) {
  Solids solids;
  std::vector<int> index(static_cast<size_t>(m.ngeom), -1);
  for (int geom = 0; geom < m.ngeom; ++geom) {
    if (IsLooks(m, geom)) continue;
    const int body = m.geom_bodyid[geom];
    Solid solid{.name = body > 0 ? NameOf(m, mjOBJ_BODY, body) : NameOf(m, mjOBJ_GEOM, geom),
                .body = body,
                .geom = geom,
                .size = Eigen::Map<const Vector3d>(m.geom_size + 3 * geom),
                .X_BG = ReadPose(m.geom_pos + 3 * geom, m.geom_quat + 4 * geom)};
    if (!ReadShape(m, geom, &solid)) continue;
    index[static_cast<size_t>(geom)] = static_cast<int>(solids.list.size());
    solids.list.push_back(std::move(solid));
  }
  for (int pair = 0; pair < m.npair; ++pair) {
    const int a = index[static_cast<size_t>(m.pair_geom1[pair])];
    const int b = index[static_cast<size_t>(m.pair_geom2[pair])];
    if (a >= 0 && b >= 0) solids.declared.emplace_back(std::min(a, b), std::max(a, b));
  }
  if (!CollidesByType(m)) return solids;
  const int count = static_cast<int>(solids.list.size());
  for (int a = 0; a < count; ++a) {
    const int g = solids.list[static_cast<size_t>(a)].geom;
    if (m.geom_contype[g] == 0 && m.geom_conaffinity[g] == 0) continue;
    for (int b = a + 1; b < count; ++b) {
      const int h = solids.list[static_cast<size_t>(b)].geom;
      if ((m.geom_contype[g] & m.geom_conaffinity[h]) != 0 ||
          (m.geom_contype[h] & m.geom_conaffinity[g]) != 0) {
        solids.by_type.emplace_back(a, b);
      }
    }
  }
  return solids;
}

}  // namespace dexcheck
