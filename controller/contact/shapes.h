#pragma once

// The surfaces that a fingertip or an object can have. Lengths in m, angles in rad, body frame; outward
// normals.

#include <memory>

#include "controller/contact/surface.h"
#include "controller/model/rigid_body.h"

namespace dexcheck {

/// Half space z <= 0: c(u, v) = (u, v, 0), normal +z.
class Plane final : public Surface {
 public:
  [[nodiscard]] SurfaceProjection Project(const Vector3d& p) const override;

 private:
  [[nodiscard]] SurfaceJet DoCalcJet(const SurfacePoint& alpha) const override;
  [[nodiscard]] SurfacePoint DoToChart(const SurfacePoint& alpha, int chart) const override;
};

/// Lateral surface of an unbounded cylinder about z: c(u, v) = (rho cos u, rho sin u, v).
class Cylinder final : public Surface {
 public:
  /// Throws std::invalid_argument unless radius (m) is positive.
  explicit Cylinder(double radius);
  [[nodiscard]] double radius() const { return radius_; }
  [[nodiscard]] SurfaceProjection Project(const Vector3d& p) const override;

 private:
  [[nodiscard]] SurfaceJet DoCalcJet(const SurfacePoint& alpha) const override;
  [[nodiscard]] SurfacePoint DoToChart(const SurfacePoint& alpha, int chart) const override;

  double radius_;
};

/// Ellipsoid about the origin with three free semi-axes along x, y, z: the unit sphere in two charts, u
/// longitude and v latitude, each coordinate scaled by its semi-axis. Chart 0 has its poles on z, c(u, v) =
/// (a cos v cos u, b cos v sin u, c sin v); chart 1 has them on x, the axes exchanged cyclically. Not
/// orthogonal unless a = b.
class Ellipsoid : public Surface {
 public:
  /// Throws std::invalid_argument unless all semi-axes (3x1, m) are positive.
  explicit Ellipsoid(const Vector3d& semi_axes, const char* name = "ellipsoid semi-axis [m]");
  [[nodiscard]] const Vector3d& semi_axes() const { return semi_axes_; }
  [[nodiscard]] int num_charts() const final { return 2; }
  [[nodiscard]] SurfaceProjection Project(const Vector3d& p) const override;

 private:
  [[nodiscard]] SurfaceJet DoCalcJet(const SurfacePoint& alpha) const final;
  [[nodiscard]] SurfacePoint DoToChart(const SurfacePoint& alpha, int chart) const final;
  [[nodiscard]] bool DoHasMargin(const SurfacePoint& alpha) const final;

  Vector3d semi_axes_;
};

/// Sphere about the origin, an ellipsoid whose closest points are known without iteration.
class Sphere final : public Ellipsoid {
 public:
  /// Throws std::invalid_argument unless radius (m) is positive.
  explicit Sphere(double radius) : Ellipsoid(Vector3d::Constant(radius), "sphere radius [m]") {}
  [[nodiscard]] double radius() const { return semi_axes().x(); }
  [[nodiscard]] SurfaceProjection Project(const Vector3d& p) const override;
};

/// Box about the origin, its faces across x, y, z. Each face is a chart, which ends at its edges: chart 2 i
/// is the face on the positive side of axis i, c(u, v) = (h_i, u, v) in the axes i, i + 1, i + 2; chart 2 i +
/// 1 the one opposite, c(u, v) = (-h_i, v, u). A contact does not roll over an edge, where the normal jumps.
class Box final : public Surface {
 public:
  /// Throws std::invalid_argument unless all half lengths (3x1, m) are positive.
  explicit Box(const Vector3d& half_size);
  [[nodiscard]] const Vector3d& half_size() const { return half_size_; }
  [[nodiscard]] int num_charts() const override { return 6; }
  /// Projects a point that is nearest to an edge onto that edge, in the chart of the face farther from it.
  [[nodiscard]] SurfaceProjection Project(const Vector3d& p) const override;
  [[nodiscard]] bool Contains(const SurfacePoint& alpha, double margin) const override;

 private:
  /// Throws SingularityError beyond an edge.
  [[nodiscard]] SurfaceJet DoCalcJet(const SurfacePoint& alpha) const override;
  /// Nearest point of the other face.
  [[nodiscard]] SurfacePoint DoToChart(const SurfacePoint& alpha, int chart) const override;

  Vector3d half_size_;
};

/// Torus about z: c(u, v) = ((R + r cos v) cos u, (R + r cos v) sin u, r sin v), u along the ring and v
/// around the tube, v = 0 on the outer equator. The chart is regular everywhere; both coordinates are
/// periodic.
class Torus final : public Surface {
 public:
  /// Throws std::invalid_argument unless 0 < tube_radius < ring_radius (m).
  Torus(double ring_radius, double tube_radius);
  [[nodiscard]] double ring_radius() const { return ring_radius_; }
  [[nodiscard]] double tube_radius() const { return tube_radius_; }
  [[nodiscard]] SurfaceProjection Project(const Vector3d& p) const override;

 private:
  [[nodiscard]] SurfaceJet DoCalcJet(const SurfacePoint& alpha) const override;
  [[nodiscard]] SurfacePoint DoToChart(const SurfacePoint& alpha, int chart) const override;

  double ring_radius_;
  double tube_radius_;
};

/// The surface of a solid, in the solid's frame: of a sphere, a cylinder (its side, unbounded), an ellipsoid,
/// a torus or a box, over whose edges no contact rolls.
/// @throws std::invalid_argument for a capsule, whose surface has jumps of curvature that (40) cannot cross.
std::unique_ptr<Surface> MakeSurface(const Shape& shape);

/// The point of a surface that two angles (rad) name in a scenario: its coordinates in chart 0, but of a box
/// longitude u and latitude v of the ray from the centre that leaves the box there.
SurfacePoint PointAtAngles(const Surface& surface, double u, double v);

}  // namespace dexcheck
