#include "renders/viewpoint.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

/// Along one side vector s of the picture and the axis f, a sphere is between the edges of a camera at c when
///   s.(p - c) + radius sqrt(1 + high^2) <=  high f.(p - c)
///   s.(p - c) - radius sqrt(1 + low^2)  >= -low  f.(p - c)
/// so that  s.c - high f.c >= floor  and  s.c + low f.c <= ceiling.
struct Slab {
  double low, high;
  double floor = -std::numeric_limits<double>::infinity();
  double ceiling = std::numeric_limits<double>::infinity();

  void Include(double along, double depth, double radius) {
    floor = std::max(floor, along - high * depth + radius * std::hypot(1.0, high));
    ceiling = std::min(ceiling, along + low * depth - radius * std::hypot(1.0, low));
  }
  /// Largest f.c.
  [[nodiscard]] double nearest() const { return (ceiling - floor) / (low + high); }
  /// s.c in the middle of what is allowed at f.c = depth.
  [[nodiscard]] double FindMiddle(double depth) const {
    return 0.5 * (floor + high * depth + ceiling - low * depth);
  }
};

}  // namespace

Viewpoint LookFrom(const Vector3d& eye, const Vector3d& look_at) {
  const Vector3d way = look_at - eye;
  Require(way.norm() > 0.0, "distance of the camera", "must be positive", way.norm());
  return {look_at, way.norm(), std::atan2(way.y(), way.x()),
          std::asin(std::clamp(way.z() / way.norm(), -1.0, 1.0))};
}

Viewpoint FitViewpoint(std::span<const VisibleSphere> spheres, double azimuth, double elevation,
                       const ViewEdges& edges) {
  Require(!spheres.empty(), "spheres", "must be at least one", 0.0);
  const Vector3d forward(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                         std::sin(elevation));
  const Vector3d right(std::sin(azimuth), -std::cos(azimuth), 0.0);
  const Vector3d up = right.cross(forward);
  Slab across{edges.left, edges.right};
  Slab upwards{edges.bottom, edges.top};
  double middle = 0.0;
  for (const VisibleSphere& sphere : spheres) {
    const double depth = forward.dot(sphere.center);
    across.Include(right.dot(sphere.center), depth, sphere.radius);
    upwards.Include(up.dot(sphere.center), depth, sphere.radius);
    middle += depth / static_cast<double>(spheres.size());
  }
  const double depth = std::min(across.nearest(), upwards.nearest());
  const Vector3d camera = depth * forward + across.FindMiddle(depth) * right + upwards.FindMiddle(depth) * up;
  return {camera + (middle - depth) * forward, middle - depth, azimuth, elevation};
}

}  // namespace dexcheck
