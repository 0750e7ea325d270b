#pragma once

// Smooth closed or unbounded surfaces of rigid bodies, each an atlas of charts (section 4.3 (a), (b)).
//
// All lengths in m, angles in rad, vectors in the frame of the body that the surface belongs to. Every chart
// is ordered so that c_u x c_v points out of the body. A chart need not be orthogonal: with x = c_u / |c_u|,
// z = n and y = z x x, the metric M is the upper triangular matrix that satisfies [c_u c_v] = [x y] M. Then
//   contact point  pdot = [x y] M alphadot,
//   normal         ndot = [x y] K M alphadot,
//   frame          y^T xdot = T M alphadot,
// which is all that the contact equations (40) use. In an orthogonal chart y = c_v / |c_v|, M is diagonal,
// and M, K, T are the matrices printed in (37).

#include "controller/common/types.h"

namespace dexcheck {

/// Local coordinates alpha = (u, v) of a surface point (35), with the chart of the atlas that they belong to.
struct SurfacePoint {
  double u = 0.0, v = 0.0;
  int chart = 0;
};

/// A chart c(u, v) at one point, with its first and second partial derivatives (36).
struct SurfaceJet {
  Vector3d c;
  Vector3d c_u, c_v;
  Vector3d c_uu = Vector3d::Zero(), c_uv = Vector3d::Zero(), c_vv = Vector3d::Zero();
};

/// Geometry of a surface at one point: Gauss frame (38) and the geometric parameters M, K, T (37).
struct SurfaceGeometry {
  Vector3d p;            ///< c(u, v), m
  Matrix3d R;            ///< Gauss frame [x y z], columns in the body frame, z the outward normal
  Matrix2d M;            ///< metric, upper triangular but on a parallel surface
  Matrix2d K;            ///< curvature in (x, y), 1/m, positive where the body is convex
  Eigen::RowVector2d T;  ///< torsion, 1/m

  /// Pose g_bc of the contact frame in the body frame: origin p, axes R.
  [[nodiscard]] Pose CalcPose() const;
};

/// Gauss frame and geometric parameters (37), (38) from a chart's derivatives, orthogonal or not.
/// c_u and c_v must be linearly independent.
SurfaceGeometry CalcSurfaceGeometry(const SurfaceJet& jet);

/// Geometry of the parallel surface at a signed distance (m) along the outward normal, in the same
/// coordinates and with the same Gauss frame. Distances stay below the smallest radius of curvature.
SurfaceGeometry CalcParallelSurface(const SurfaceGeometry& surface, double distance);

/// Closest surface point to a point in space.
struct SurfaceProjection {
  SurfacePoint alpha;
  double distance = 0.0;  ///< signed, m; positive outside the body
};

/// A surface with its atlas; evaluation neither allocates nor changes the object.
class Surface {
 public:
  virtual ~Surface() = default;

  /// Number of charts; valid chart indices are 0 .. num_charts() - 1.
  [[nodiscard]] virtual int num_charts() const { return 1; }

  /// Geometry at alpha (35)-(38). Throws std::invalid_argument for an unknown chart or coordinates that are
  /// not finite, SingularityError where the chart degenerates (a pole).
  [[nodiscard]] SurfaceGeometry Evaluate(const SurfacePoint& alpha) const;

  /// Inverse map: the surface point closest to p (3x1, m, body frame), in normalized coordinates.
  /// Throws SingularityError where the closest point is not unique (a centre, an axis).
  [[nodiscard]] virtual SurfaceProjection Project(const Vector3d& p) const = 0;

  /// Inverse map for a point said to lie on the surface: as Project, but throws std::invalid_argument when p
  /// (3x1, m, body frame) is farther than `tolerance` (m) from the surface.
  [[nodiscard]] SurfacePoint Locate(const Vector3d& p, double tolerance) const;

  /// Expresses a point in the coordinates of `chart`, periodic coordinates in [-pi, pi].
  /// Throws std::invalid_argument for an unknown chart.
  [[nodiscard]] SurfacePoint ToChart(const SurfacePoint& alpha, int chart) const;

  /// Expresses a point with periodic coordinates in [-pi, pi], in its own chart if that holds it away from
  /// the chart's edge, otherwise in one that does. Changing charts turns the Gauss frame about the normal.
  [[nodiscard]] SurfacePoint Normalize(const SurfacePoint& alpha) const;

  /// Whether the chart holds these coordinates, and an edge at which it ends is `margin` (m) away or more. A
  /// surface without edges holds all.
  [[nodiscard]] virtual bool Contains(const SurfacePoint& /*alpha*/, double /*margin*/) const { return true; }

 protected:
  Surface() = default;
  Surface(const Surface&) = default;
  Surface& operator=(const Surface&) = default;

 private:
  [[nodiscard]] virtual SurfaceJet DoCalcJet(const SurfacePoint& alpha) const = 0;
  [[nodiscard]] virtual SurfacePoint DoToChart(const SurfacePoint& alpha, int chart) const = 0;
  // True where the chart is well conditioned; the parts of all charts where this holds cover the surface.
  [[nodiscard]] virtual bool DoHasMargin(const SurfacePoint& /*alpha*/) const { return true; }
};

}  // namespace dexcheck
