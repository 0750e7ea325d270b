#pragma once

// The shapes of the bodies in an MJCF, whether the engine lets them touch or not, and how far two of them are
// apart.

#include <mujoco/mujoco.h>

#include <string>
#include <utility>
#include <vector>

#include "controller/common/types.h"

namespace dexcheck {

/// One rigid shape of a body: convex, or a torus.
struct Solid {
  enum class Shape { kPlane, kSphere, kCapsule, kCylinder, kEllipsoid, kBox, kHull, kTorus };
  Shape shape = Shape::kSphere;
  std::string name;  ///< Of its body; of the world's own, the geom's.
  int body = 0;      ///< The engine's.
  int geom = 0;      ///< Likewise, of the model that was listed.
  /// As the engine's geom_size: radius; radius and half length; half axes; of a torus ring and tube radius.
  Vector3d size = Vector3d::Zero();
  Pose X_BG = Pose::Identity();  ///< In its body. Capsule, cylinder and torus lie along z, a plane's normal.
  std::vector<Vector3d> vertices;  ///< Of a hull, in G.
  double reach = 0.0;              ///< From G's origin to its farthest point, m; of a plane infinite.
};

/// The shapes of all bodies.
struct Solids {
  std::vector<Solid> list;
  /// Indices of two whose contact the MJCF declares, by a pair or, of geoms that touch by contype and
  /// conaffinity, so.
  std::vector<std::pair<int, int>> declared, by_type;
};

/// Lists them. Of a body that has geoms of group 3, in which MJCFs keep what collides apart from what is
/// seen, those count, and of others all but meshes that touch nothing beside geoms that do; a mesh is its
/// convex hull unless it is marked as a torus. Height fields are left out.
Solids ListSolids(const mjModel& model);

/// Distance of a solid from another, m; negative when they overlap: by how far one must move to be clear.
/// Exact to 1e-7 m while the two are apart, where a torus's nearest place is searched for from 32 places of
/// its ring. Of convex shapes that overlap it is the least of what directions along faces, axes and centres
/// and a descent from the best of them find; two planes, and two tori, are measured by their hulls.
/// @param X_WA, X_WB poses of the solids' own frames G. Does not allocate.
double CalcDistance(const Solid& a, const Pose& X_WA, const Solid& b, const Pose& X_WB);

}  // namespace dexcheck
