#include "controller/contact/surface.h"

#include <Eigen/LU>
#include <cmath>

#include "controller/common/errors.h"

namespace dexcheck {

Pose SurfaceGeometry::CalcPose() const {
  Pose g_bc;
  g_bc.linear() = R;
  g_bc.translation() = p;
  g_bc.makeAffine();
  return g_bc;
}

SurfaceGeometry CalcSurfaceGeometry(const SurfaceJet& jet) {
  SurfaceGeometry geometry;
  geometry.p = jet.c;

  // x = c_u / |c_u|,  z = c_u x c_v / |c_u x c_v|,  y = z x x
  const double c_u_norm = jet.c_u.norm();
  const Vector3d x = jet.c_u / c_u_norm;
  const Vector3d z = jet.c_u.cross(jet.c_v).normalized();
  const Vector3d y = z.cross(x);
  geometry.R << x, y, z;

  // [c_u c_v] = [x y] M
  const double m_uv = x.dot(jet.c_v);
  const double m_vv = y.dot(jet.c_v);
  geometry.M << c_u_norm, m_uv, 0.0, m_vv;

  // K = [x y]^T [n_u n_v] M^-1 = -M^-T [n.c_uu n.c_uv; n.c_uv n.c_vv] M^-1, because c_u.n_u = -n.c_uu etc.
  Matrix2d M_inverse;
  M_inverse << 1.0 / c_u_norm, -m_uv / (c_u_norm * m_vv), 0.0, 1.0 / m_vv;
  Matrix2d second_form;
  second_form << z.dot(jet.c_uu), z.dot(jet.c_uv), z.dot(jet.c_uv), z.dot(jet.c_vv);
  geometry.K = -M_inverse.transpose() * second_form * M_inverse;

  // T = y^T [x_u x_v] M^-1 with y.x_u = y.c_uu / |c_u|, y.x_v = y.c_uv / |c_u|
  geometry.T = Eigen::RowVector2d(y.dot(jet.c_uu), y.dot(jet.c_uv)) / c_u_norm * M_inverse;
  return geometry;
}

SurfaceGeometry CalcParallelSurface(const SurfaceGeometry& surface, double distance) {
  // c' = c + distance n:  [x y] M' = [x y] (I + distance K) M, the normal's and the frame's turn unchanged
  const Matrix2d stretch = Matrix2d::Identity() + distance * surface.K;
  const Matrix2d stretch_inverse = stretch.inverse();
  SurfaceGeometry parallel = surface;
  parallel.p += distance * surface.R.col(2);
  parallel.M = stretch * surface.M;
  parallel.K = surface.K * stretch_inverse;
  parallel.T = surface.T * stretch_inverse;
  return parallel;
}

SurfaceGeometry Surface::Evaluate(const SurfacePoint& alpha) const {
  Require(alpha.chart >= 0 && alpha.chart < num_charts(), "chart", "must be a chart of the surface",
          alpha.chart);
  Require(std::isfinite(alpha.u), "u", "must be finite", alpha.u);
  Require(std::isfinite(alpha.v), "v", "must be finite", alpha.v);
  return CalcSurfaceGeometry(DoCalcJet(alpha));
}

SurfacePoint Surface::Locate(const Vector3d& p, double tolerance) const {
  const SurfaceProjection projection = Project(p);
  Require(std::abs(projection.distance) <= tolerance, "distance of the contact point from the surface [m]",
          "must be within the tolerance", projection.distance);
  return projection.alpha;
}

SurfacePoint Surface::ToChart(const SurfacePoint& alpha, int chart) const {
  Require(alpha.chart >= 0 && alpha.chart < num_charts(), "chart", "must be a chart of the surface",
          alpha.chart);
  Require(chart >= 0 && chart < num_charts(), "chart", "must be a chart of the surface", chart);
  return DoToChart(alpha, chart);
}

SurfacePoint Surface::Normalize(const SurfacePoint& alpha) const {
  const SurfacePoint same_chart = ToChart(alpha, alpha.chart);
  if (DoHasMargin(same_chart)) return same_chart;
  for (int chart = 0; chart < num_charts(); ++chart) {
    const SurfacePoint candidate = DoToChart(alpha, chart);
    if (DoHasMargin(candidate)) return candidate;
  }
  return same_chart;
}

}  // namespace dexcheck
