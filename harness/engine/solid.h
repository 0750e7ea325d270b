#pragma once

// The shapes of the bodies in an MJCF, whether the engine lets them touch or not, and their distances.

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
  std::string name;  ///< Name of its body; for the world's own solids, the geom's.
  int body = 0;      ///< The engine's.
  int geom = 0;      ///< The engine's geom, of the model that was listed.
  /// Sizes as in geom_size: radius; radius and half length; half axes; for a torus ring and tube radius.
  Vector3d size = Vector3d::Zero();
  Pose X_BG = Pose::Identity();    ///< In its body. Capsule, cylinder and torus lie along z, and so does a
                                   ///< plane's normal.
  std::vector<Vector3d> vertices;  ///< Vertices of a hull, in G.
  double reach = 0.0;  ///< Distance from G's origin to its farthest point, m; infinite for a plane.
};

/// The shapes of all bodies.
struct Solids {
  std::vector<Solid> list;
  /// Indices of solids whose contact the MJCF declares by a pair, or by contype and conaffinity.
  std::vector<std::pair<int, int>> declared, by_type;
};

/// Lists the solids of a model. A body that has geoms of group 3, in which MJCFs keep collision shapes, has
/// those; other bodies have all geoms but meshes that touch nothing beside geoms that do. A mesh is its
/// convex hull unless it is marked as a torus. Height fields are left out.
Solids ListSolids(const mjModel& model);

/// Returns the distance of a solid from another, m; negative when they overlap: the way that one must move to
/// be clear. It is exact to 1e-7 m while the two are apart, where a torus's nearest place is searched for
/// from 32 places of its ring. For convex shapes that overlap it is the least depth along faces, axes and
/// centres and by a descent from the best of them; two planes, and two tori, are measured by their hulls.
/// @param X_WA, X_WB poses of the solids' own frames G. Does not allocate.
double CalcDistance(const Solid& a, const Pose& X_WA, const Solid& b, const Pose& X_WB);

}  // namespace dexcheck
