// Distance of two solids by the algorithm of Gilbert, Johnson and Keerthi: the distance of their difference,
// A - B, from the origin. Spheres and capsules are a point and a segment with a radius, so that the
// algorithm's shapes have few corners.

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/engine/solid.h"

namespace dexcheck {
namespace {

using enum Solid::Shape;

/// Accuracy of a distance, m.
constexpr double kAccuracy = 1e-7;
constexpr int kMostIterations = 64;
/// The difference's corners are of this order at least, m: smaller simplices are points.
constexpr double kFlat = 1e-20;
/// A tetrahedron that is lower has no inside, m.
constexpr double kFlatHeight = 1e-10;
/// Places of a torus's ring where the search for the nearest one starts.
constexpr int kNearPlaces = 32;
constexpr int kRingSearch = 30;  // halves a place's width to 1e-6 of it by golden sections
constexpr int kDescent = 60;

/// Returns the radius that rounds a solid's core, m; 0 for solids without one.
double RadiusOf(const Solid& solid) {
  if (solid.shape == kSphere || solid.shape == kCapsule) return solid.size[0];
  return solid.shape == kTorus ? solid.size[1] : 0.0;
}

/// The point of a solid without its radius that is farthest along d, in the solid's frame.
Vector3d SupportOf(const Solid& solid, const Vector3d& d) {
  const Vector3d& s = solid.size;
  switch (solid.shape) {
    case kCapsule:
      return {0.0, 0.0, std::copysign(s[1], d.z())};
    case kCylinder: {
      const double flat = std::hypot(d.x(), d.y());
      const double scale = flat > 0.0 ? s[0] / flat : 0.0;
      return {scale * d.x(), scale * d.y(), std::copysign(s[1], d.z())};
    }
    case kEllipsoid: {
      const Vector3d scaled = s.cwiseProduct(d);
      const double norm = scaled.norm();
      return norm > 0.0 ? Vector3d(s.cwiseProduct(scaled) / norm) : Vector3d(s.x(), 0.0, 0.0);
    }
    case kBox:
      return {std::copysign(s[0], d.x()), std::copysign(s[1], d.y()), std::copysign(s[2], d.z())};
    case kHull: {
      const Vector3d* best = &solid.vertices.front();
      double most = best->dot(d);
      for (const Vector3d& vertex : solid.vertices) {
        const double along = vertex.dot(d);
        if (along <= most) continue;
        most = along;
        best = &vertex;
      }
      return *best;
    }
    case kTorus: {
      const double flat = std::hypot(d.x(), d.y());
      if (flat == 0.0) return {s[0], 0.0, 0.0};
      return {s[0] * d.x() / flat, s[0] * d.y() / flat, 0.0};
    }
    default:
      return Vector3d::Zero();
  }
}

/// A - B without the radii, in A's frame.
struct Difference {
  const Solid& a;
  const Solid& b;
  Pose X_AB;

  [[nodiscard]] Vector3d Support(const Vector3d& d) const {
    return SupportOf(a, d) - X_AB * SupportOf(b, X_AB.linear().transpose() * -d);
  }
};

/// Point of a segment, triangle or tetrahedron nearest to the origin, by its corners that matter, which are
/// kept: count becomes how many.
struct Simplex {
  Vector3d corner[4];
  int count = 0;

  Vector3d Keep(std::initializer_list<int> which) {
    Vector3d kept[4];
    int n = 0;
    for (const int i : which) kept[n++] = corner[i];
    std::copy_n(kept, n, corner);
    count = n;
    return Nearest();
  }

  Vector3d NearestOfSegment() {
    const Vector3d along = corner[1] - corner[0];
    const double t = -corner[0].dot(along);
    const double length = along.squaredNorm();
    if (t <= 0.0 || length < kFlat) return Keep({0});
    if (t >= length) return Keep({1});
    return corner[0] + t / length * along;
  }

  /// Ericson, Real-Time Collision Detection, section 5.1.5: by the region of the triangle's plane.
  Vector3d NearestOfTriangle() {
    const Vector3d& a = corner[0];
    const Vector3d ab = corner[1] - a;
    const Vector3d ac = corner[2] - a;
    const double d1 = -ab.dot(a), d2 = -ac.dot(a);
    if (d1 <= 0.0 && d2 <= 0.0) return Keep({0});
    const double d3 = -ab.dot(corner[1]), d4 = -ac.dot(corner[1]);
    if (d3 >= 0.0 && d4 <= d3) return Keep({1});
    const double d5 = -ab.dot(corner[2]), d6 = -ac.dot(corner[2]);
    if (d6 >= 0.0 && d5 <= d6) return Keep({2});
    if (d1 * d4 - d3 * d2 <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return Keep({0, 1});
    if (d5 * d2 - d1 * d6 <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return Keep({0, 2});
    if (d3 * d6 - d5 * d4 <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) return Keep({1, 2});
    const Vector3d normal = ab.cross(ac);
    return a.dot(normal) / normal.squaredNorm() * normal;
  }

  /// Zero when the origin is inside.
  Vector3d NearestOfTetrahedron() {
    static constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
    Simplex best;
    Vector3d nearest = Vector3d::Zero();
    double least = std::numeric_limits<double>::infinity();
    for (const auto& face : kFaces) {
      const Vector3d& p = corner[face[0]];
      const Vector3d normal = (corner[face[1]] - p).cross(corner[face[2]] - p);
      // The face counts unless the origin is on the same side of it as the fourth corner. A flat tetrahedron
      // has no such side.
      const double of_fourth = normal.dot(corner[face[3]] - p);
      const bool is_flat = of_fourth * of_fourth <= kFlatHeight * kFlatHeight * normal.squaredNorm();
      if (!is_flat && -normal.dot(p) * of_fourth > 0.0) continue;
      Simplex triangle;
      for (int i = 0; i < 3; ++i) triangle.corner[i] = corner[face[i]];
      triangle.count = 3;
      const Vector3d candidate = triangle.NearestOfTriangle();
      if (candidate.squaredNorm() >= least) continue;
      least = candidate.squaredNorm();
      nearest = candidate;
      best = triangle;
    }
    if (best.count > 0) *this = best;
    return nearest;
  }

  Vector3d Nearest() {
    if (count == 1) return corner[0];
    if (count == 2) return NearestOfSegment();
    return count == 3 ? NearestOfTriangle() : NearestOfTetrahedron();
  }
};

/// Distance of the cores; 0 when they overlap.
double CalcCoreDistance(const Difference& difference) {
  Simplex simplex;
  simplex.corner[0] = difference.Support(difference.X_AB.translation());
  simplex.count = 1;
  Vector3d v = simplex.corner[0];
  for (int i = 0; i < kMostIterations; ++i) {
    const double distance = v.norm();
    if (distance < kAccuracy) return 0.0;
    const Vector3d w = difference.Support(-v);
    // No point of the difference is nearer than v w / |v|.
    if (distance - v.dot(w) / distance <= kAccuracy) return distance;
    simplex.corner[simplex.count++] = w;
    const Vector3d next = simplex.Nearest();
    if (simplex.count == 4) return 0.0;
    if (!(next.squaredNorm() < v.squaredNorm())) return distance;
    v = next;
  }
  return v.norm();
}

/// How deep the cores overlap: the least extent of the difference beyond the origin over the directions
/// tried.
double CalcCoreDepth(const Difference& difference) {
  Vector3d best = Vector3d::UnitZ();
  Vector3d farthest = Vector3d::Zero();
  double depth = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Vector3d& n) {
    const Vector3d s = difference.Support(n);
    if (!(s.dot(n) < depth)) return false;
    depth = s.dot(n);
    farthest = s;
    best = n;
    return true;
  };
  for (const double side : {1.0, -1.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      consider(side * Vector3d::Unit(axis));
      consider(side * difference.X_AB.linear().col(axis));
    }
  }
  const Vector3d& between = difference.X_AB.translation();
  if (between.norm() > 0.0) consider(-between.normalized());
  for (const int axis : {0, 1, 2}) {
    // The direction of a rounded side leads from the axis to the other's centre.
    const Vector3d along_a = Vector3d::Unit(axis);
    const Vector3d along_b = difference.X_AB.linear().col(axis);
    for (const Vector3d& along : {along_a, along_b}) {
      const Vector3d aside = between - between.dot(along) * along;
      if (aside.norm() > 0.0) consider(-aside.normalized());
    }
    const Vector3d edge = along_a.cross(along_b);
    if (edge.norm() > 1e-6) {
      consider(edge.normalized());
      consider(-edge.normalized());
    }
  }
  // The extent's slope along the sphere of directions is the farthest point's part across n.
  double step = 0.5;
  for (int i = 0; i < kDescent && step > 1e-6; ++i) {
    const Vector3d across = farthest - farthest.dot(best) * best;
    if (across.norm() < kAccuracy) break;
    if (!consider((best - step * across.normalized()).normalized())) step *= 0.5;
  }
  // The depth of bodies that are apart is the negative of their distance.
  return depth;
}

double CalcConvexDistance(const Solid& a, const Pose& X_WA, const Solid& b, const Pose& X_WB) {
  const Difference difference{a, b, X_WA.inverse(Eigen::Isometry) * X_WB};
  const double apart = CalcCoreDistance(difference);
  return (apart > 0.0 ? apart : -CalcCoreDepth(difference)) - RadiusOf(a) - RadiusOf(b);
}

double CalcPlaneDistance(const Solid& other, const Pose& X_WO, const Pose& X_WP) {
  const Vector3d normal = X_WP.linear().col(2);
  const Vector3d lowest = X_WO * SupportOf(other, X_WO.linear().transpose() * -normal);
  return normal.dot(lowest - X_WP.translation()) - RadiusOf(other);
}

/// A torus is a ball rolled around its ring.
double CalcTorusDistance(const Solid& torus, const Pose& X_WT, const Solid& other, const Pose& X_WO) {
  const Solid ball{.shape = kSphere, .size = Vector3d(torus.size[1], 0.0, 0.0)};
  const auto measure = [&](double u) {
    Pose X_WB = Pose::Identity();
    X_WB.translation() = X_WT * Vector3d(torus.size[0] * std::cos(u), torus.size[0] * std::sin(u), 0.0);
    return CalcConvexDistance(ball, X_WB, other, X_WO);
  };
  constexpr double kWidth = 2.0 * kPi / kNearPlaces;
  double nearest = 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kNearPlaces; ++i) {
    const double distance = measure(kWidth * i);
    if (distance >= least) continue;
    least = distance;
    nearest = kWidth * i;
  }
  constexpr double kGolden = 0.6180339887498949;
  double from = nearest - kWidth;
  double to = nearest + kWidth;
  double left = to - kGolden * (to - from);
  double right = from + kGolden * (to - from);
  double at_left = measure(left);
  double at_right = measure(right);
  for (int i = 0; i < kRingSearch; ++i) {
    if (at_left < at_right) {
      to = right;
      right = left;
      at_right = at_left;
      left = to - kGolden * (to - from);
      at_left = measure(left);
    } else {
      from = left;
      left = right;
      at_left = at_right;
      right = from + kGolden * (to - from);
      at_right = measure(right);
    }
  }
  return std::min({least, at_left, at_right});
}

}  // namespace

double CalcDistance(const Solid& a, const Pose& X_WA, const Solid& b, const Pose& X_WB) {
  if (a.shape == kPlane) return CalcPlaneDistance(b, X_WB, X_WA);
  if (b.shape == kPlane) return CalcPlaneDistance(a, X_WA, X_WB);
  if (a.shape == kTorus && b.shape != kTorus) return CalcTorusDistance(a, X_WA, b, X_WB);
  if (b.shape == kTorus && a.shape != kTorus) return CalcTorusDistance(b, X_WB, a, X_WA);
  return CalcConvexDistance(a, X_WA, b, X_WB);
}

}  // namespace dexcheck
