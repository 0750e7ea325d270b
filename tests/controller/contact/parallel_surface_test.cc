// Parallel surfaces: contacts of bodies that overlap.

#include <gtest/gtest.h>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/shapes.h"

namespace dexcheck::testing::parallel_surface_test {
namespace {

constexpr double kRounding = 1e-13;
constexpr SurfacePoint kPoints[] = {{0.3, 0.2, 0}, {-1.1, 0.7, 0}, {2.0, -0.5, 0}};

void ExpectSame(const SurfaceGeometry& a, const SurfaceGeometry& b) {
  EXPECT_LE((a.p - b.p).norm(), kRounding);
  EXPECT_LE((a.R - b.R).norm(), kRounding);
  EXPECT_LE((a.M - b.M).norm(), kRounding);
  EXPECT_LE((a.K - b.K).norm(), kRounding * b.K.norm());
  EXPECT_LE((a.T - b.T).norm(), kRounding * (1.0 + b.T.norm()));
}

TEST(ParallelSurface, OfATorusIsATorus) {
  const Torus torus(0.6, 0.2);
  const Torus thinner(0.6, 0.17);
  for (const SurfacePoint& at : kPoints) {
    ExpectSame(CalcParallelSurface(torus.Evaluate(at), -0.03), thinner.Evaluate(at));
  }
}

// K and M are full matrices, because the chart's lines are not lines of curvature.
TEST(ParallelSurface, OfAnEllipsoidMovesAsItsPointsDo) {
  const Ellipsoid ellipsoid(Vector3d(0.5, 0.7, 0.9));
  constexpr double kDistance = 0.05;
  constexpr double kStep = 1e-6;  // central differences: errors of 1e-12 / kStep
  for (const SurfacePoint& at : kPoints) {
    const SurfaceGeometry surface = CalcParallelSurface(ellipsoid.Evaluate(at), kDistance);
    EXPECT_GT(std::abs(ellipsoid.Evaluate(at).K(0, 1)), 1e-3);
    for (int k = 0; k < 2; ++k) {
      SurfacePoint ahead = at;
      SurfacePoint behind = at;
      (k == 0 ? ahead.u : ahead.v) += kStep;
      (k == 0 ? behind.u : behind.v) -= kStep;
      const SurfaceGeometry a = CalcParallelSurface(ellipsoid.Evaluate(ahead), kDistance);
      const SurfaceGeometry b = CalcParallelSurface(ellipsoid.Evaluate(behind), kDistance);
      const Vector2d rate = surface.M.col(k);
      const auto xy = surface.R.leftCols<2>();
      EXPECT_LE(((a.p - b.p) / (2.0 * kStep) - xy * rate).norm(), 1e-8);
      EXPECT_LE(((a.R.col(2) - b.R.col(2)) / (2.0 * kStep) - xy * (surface.K * rate)).norm(), 1e-8);
      const Vector3d x_dot = (a.R.col(0) - b.R.col(0)) / (2.0 * kStep);
      EXPECT_NEAR(surface.R.col(1).dot(x_dot), surface.T.dot(rate), 1e-8);
    }
  }
}

}  // namespace
}  // namespace dexcheck::testing::parallel_surface_test
