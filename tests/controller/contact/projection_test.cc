// The inverse map of every surface: from a point in space to the closest (u, v).

#include <gtest/gtest.h>

#include <array>

#include "controller/common/errors.h"
#include "controller/contact/shapes.h"
#include "tests/common/matrix_near.h"
#include "tests/common/throws.h"
#include "tests/controller/contact/contact_fixtures.h"

namespace dexcheck::testing::projection_test {
namespace {

constexpr int kSamples = 200;
// Rounding of coordinates of order one.
constexpr double kRounding = 1e-13;

// Distance along the normal up to which the foot of the normal is the closest point: the smallest radius of
// curvature of each test surface inside, and far outside, where only the torus has a limit (its axis).
double DrawOffset(std::mt19937& random, const NamedSurface& named, const SurfaceGeometry& geometry) {
  const double inside = named.name == "ellipsoid" ? 0.007 : 0.9 * named.length;
  const double to_axis = std::hypot(geometry.p.x(), geometry.p.y());
  const double outside = named.name == "torus" && geometry.R.col(2).head<2>().dot(geometry.p.head<2>()) < 0.0
                             ? 0.9 * to_axis
                             : 100.0 * named.length;
  return DrawUniform(random, 0.0, 1.0) < 0.5 ? DrawUniform(random, -inside, 0.0)
                                             : DrawUniform(random, 0.0, outside);
}

TEST(ProjectionTest, RoundTripFromOnNearAndFarOfTheSurface) {
  std::mt19937 random(11);
  for (const NamedSurface& named : MakeAllSurfaces()) {
    for (int sample = 0; sample < kSamples; ++sample) {
      SCOPED_TRACE(named.name);
      const SurfacePoint alpha =
          named.surface->Normalize(DrawPoint(random, named, sample % named.surface->num_charts()));
      const SurfaceGeometry geometry = named.surface->Evaluate(alpha);
      const double offset = sample % 3 == 0 ? 0.0 : DrawOffset(random, named, geometry);
      const SurfaceProjection projection = named.surface->Project(geometry.p + offset * geometry.R.col(2));
      const double scale = 1.0 + std::abs(offset) / named.length;
      EXPECT_NEAR(projection.distance / named.length, offset / named.length, kRounding * scale);
      const SurfacePoint same_chart = named.surface->ToChart(projection.alpha, alpha.chart);
      EXPECT_NEAR(std::remainder(same_chart.u - alpha.u, 2.0 * kPi), 0.0, kRounding * scale);
      EXPECT_NEAR(std::remainder(same_chart.v - alpha.v, 2.0 * kPi), 0.0, kRounding * scale);
    }
  }
}

// Any point of space, any ellipsoid: the foot is a stationary point and no sampled surface point is closer.
TEST(ProjectionTest, EllipsoidFindsTheGlobalMinimum) {
  std::mt19937 random(12);
  const std::array<Vector3d, 5> shapes = {Vector3d(0.05, 0.03, 0.02), Vector3d(0.02, 0.05, 0.03),
                                          Vector3d(0.03, 0.03, 0.01), Vector3d(0.01, 0.03, 0.03),
                                          Vector3d(1.0, 0.1, 0.001)};
  for (const Vector3d& axes : shapes) {
    const Ellipsoid ellipsoid(axes);
    for (int sample = 0; sample < kSamples; ++sample) {
      const double reach = std::pow(10.0, DrawUniform(random, -3.0, 3.0));
      Vector3d p = reach * axes.cwiseProduct(DrawVector(random, 3));
      if (sample % 5 == 0) p(sample % 3) *= 1e-12;
      SCOPED_TRACE("axes " + std::to_string(axes.x()) + " sample " + std::to_string(sample));
      const SurfaceProjection projection = ellipsoid.Project(p);
      const SurfaceGeometry foot = ellipsoid.Evaluate(projection.alpha);
      const Vector3d residual = p - foot.p - projection.distance * foot.R.col(2);
      EXPECT_TRUE(MatrixNear(residual / (axes.maxCoeff() + p.norm()), Vector3d::Zero(), kRounding));
      const bool inside = p.cwiseQuotient(axes).norm() < 1.0;
      EXPECT_EQ(projection.distance < 0.0, inside);
      for (int i = 0; i < 500; ++i) {
        const Vector3d s = DrawVector(random, 3).normalized();
        EXPECT_GE((p - axes.cwiseProduct(s)).norm(), std::abs(projection.distance) - kRounding * p.norm());
      }
    }
  }
}

TEST(ProjectionTest, PolesAndSeamsOfTheChartsAreOrdinaryPoints) {
  for (const NamedSurface& named : MakeAllSurfaces()) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        if (named.name != "sphere" && named.name != "ellipsoid") continue;
        SCOPED_TRACE(named.name + " axis " + std::to_string(axis));
        const Vector3d p = sign * Vector3d::Unit(axis);
        const SurfaceProjection projection = named.surface->Project(p);
        const SurfaceGeometry foot = named.surface->Evaluate(projection.alpha);
        EXPECT_TRUE(MatrixNear(foot.R.col(2), p, kRounding));
        EXPECT_TRUE(MatrixNear(foot.p + projection.distance * p, p, kRounding));
      }
    }
  }
}

TEST(ProjectionTest, PointsWithoutAUniqueFootAreAnError) {
  EXPECT_TRUE(Throws<SingularityError>([&] { return Sphere(0.02).Project(Vector3d::Zero()); }, "not unique"));
  EXPECT_TRUE(Throws<SingularityError>(
      [&] {
        return Cylinder(0.02).Project({0.0, 0.0, 0.3});
      },
      "not unique"));
  EXPECT_TRUE(Throws<SingularityError>(
      [&] {
        return Torus(0.03, 0.01).Project({0.0, 0.0, 0.3});
      },
      "not unique"));
  EXPECT_TRUE(Throws<SingularityError>(
      [&] {
        return Torus(0.03, 0.01).Project({0.0, 0.03, 0.0});
      },
      "not unique"));
  const Ellipsoid ellipsoid({0.05, 0.03, 0.02});
  EXPECT_TRUE(Throws<SingularityError>([&] { return ellipsoid.Project(Vector3d::Zero()); }, "not unique"));
  EXPECT_TRUE(Throws<SingularityError>([&] { return ellipsoid.Project({0.01, 0.0, 0.0}); }, "not unique"));
  // Beyond the focal curve the same axis has a unique foot again.
  EXPECT_NEAR(ellipsoid.Project({0.049, 0.0, 0.0}).distance, -0.001, kRounding);
}

}  // namespace
}  // namespace dexcheck::testing::projection_test
