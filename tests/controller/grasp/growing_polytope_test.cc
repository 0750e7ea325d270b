#include "controller/grasp/growing_polytope.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/common/matrix_near.h"

namespace dexcheck::grasp_internal::growing_polytope_test {
namespace {

// Rounding of facet planes through points of unit size: the normal of a facet that is a thousand times
// flatter than wide.
constexpr double kPlane = 1e-12;

std::array<Vector6d, 7> MakeSimplex() {
  std::array<Vector6d, 7> points;
  for (Eigen::Index k = 0; k < 6; ++k) points[static_cast<std::size_t>(k)] = Vector6d::Unit(k);
  points[6] = -0.5 * Vector6d::Ones();
  return points;
}

TEST(GrowingPolytope, CrossPolytopeHasItsFacetsWhereTheyBelong) {
  // The hull of the unit vectors and their negatives has 64 facets |x|_1 = 1, at the distance 1 / sqrt(6).
  auto simplex = MakeSimplex();
  simplex[6] = -Vector6d::Unit(0);
  for (std::size_t k = 1; k < 6; ++k) simplex[k] = Vector6d::Unit(static_cast<Eigen::Index>(k));
  GrowingPolytope polytope(simplex);
  EXPECT_NEAR(polytope.FindNearestFacet().offset, 0.0, kPlane) << "the origin is on the simplex's boundary";
  for (Eigen::Index k = 1; k < 6; ++k) EXPECT_TRUE(polytope.Add(-Vector6d::Unit(k)));
  const GrowingPolytope::Facet& facet = polytope.FindNearestFacet();
  EXPECT_NEAR(facet.offset, 1.0 / std::sqrt(6.0), kPlane * testing::TolScale());
  EXPECT_TRUE(testing::MatrixNear(facet.normal.cwiseAbs(), Vector6d::Constant(1.0 / std::sqrt(6.0)), kPlane));
}

TEST(GrowingPolytope, RefusesPointsInside) {
  GrowingPolytope polytope(MakeSimplex());
  EXPECT_FALSE(polytope.Add(Vector6d::Zero()));
  EXPECT_FALSE(polytope.Add(Vector6d::Unit(2)));
  EXPECT_TRUE(polytope.Add(1.001 * Vector6d::Unit(2)));
  EXPECT_EQ(polytope.num_vertices(), 8u);
}

TEST(GrowingPolytope, NearestFacetSupportsAllPoints) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const auto simplex = MakeSimplex();
  std::vector<Vector6d> points(simplex.begin(), simplex.end());
  GrowingPolytope polytope(simplex);
  double offset = polytope.FindNearestFacet().offset;
  const double first = offset;
  for (int sample = 0; sample < 60; ++sample) {
    Vector6d point;
    for (double& entry : point) entry = normal(random);
    points.push_back(point.normalized());
    polytope.Add(points.back());
    const GrowingPolytope::Facet& facet = polytope.FindNearestFacet();
    double farthest = -std::numeric_limits<double>::infinity();
    for (const Vector6d& other : points) farthest = std::max(farthest, facet.normal.dot(other));
    EXPECT_NEAR(farthest, facet.offset, kPlane * testing::TolScale());
    EXPECT_GE(facet.offset, offset - kPlane) << "the polytope only grows";
    offset = facet.offset;
  }
  EXPECT_GT(offset, first);
}

}  // namespace
}  // namespace dexcheck::grasp_internal::growing_polytope_test
