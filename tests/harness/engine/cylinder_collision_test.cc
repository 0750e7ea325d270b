// The exact sphere-cylinder narrow phase, by itself and inside the engine.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "controller/contact/shapes.h"
#include "harness/engine/engine.h"
#include "harness/engine/exact_collision.h"
#include "tests/common/matrix_near.h"

namespace dexcheck::testing::cylinder_collision_test {
namespace {

constexpr double kRadius = 0.05;
constexpr double kHalfLength = 0.03;
constexpr double kBall = 0.01;
constexpr double kRounding = 1e-15;  // m: positions of some 0.1 m, formed in a dozen operations

/// Distance of a point outside from the solid cylinder: what clamping leaves of it.
double CalcDistance(const Vector3d& p) {
  Vector3d nearest = p;
  const double rho = p.head<2>().norm();
  if (rho > kRadius) nearest.head<2>() *= kRadius / rho;
  nearest.z() = std::clamp(p.z(), -kHalfLength, kHalfLength);
  return (p - nearest).norm();
}

TEST(CylinderCollision, FindsTheNearestPointsOutsideAndIn) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> draw(-2.0 * kRadius, 2.0 * kRadius);
  int inside = 0;
  int side = 0;
  int end = 0;
  int rim = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vector3d center(draw(random), draw(random), draw(random));
    const ExactContact contact = CollideSphereCylinder(center, kBall, kRadius, kHalfLength);
    const double beyond_side = center.head<2>().norm() - kRadius;
    const double beyond_end = std::abs(center.z()) - kHalfLength;
    ASSERT_NEAR(contact.normal.norm(), 1.0, 4e-16);
    // The nearest points lie on either surface.
    const Vector3d on_ball = contact.position - 0.5 * contact.distance * contact.normal;
    const Vector3d on_cylinder = contact.position + 0.5 * contact.distance * contact.normal;
    ASSERT_NEAR((on_ball - center).norm(), kBall, kRounding);
    const double height = std::abs(on_cylinder.z()) - kHalfLength;
    const double width = on_cylinder.head<2>().norm() - kRadius;
    ASSERT_NEAR(std::max(height, width), 0.0, kRounding);
    if (beyond_side <= 0.0 && beyond_end <= 0.0) {
      ++inside;
      ASSERT_NEAR(contact.distance, std::max(beyond_side, beyond_end) - kBall, kRounding);
      continue;
    }
    ASSERT_NEAR(contact.distance, CalcDistance(center) - kBall, kRounding);
    ++(beyond_end <= 0.0 ? side : beyond_side <= 0.0 ? end : rim);
    if (beyond_end > 0.0) continue;
    const Cylinder cylinder(kRadius);
    const SurfaceProjection expected = cylinder.Project(center);
    ASSERT_NEAR(contact.distance, expected.distance - kBall, kRounding);
    ASSERT_TRUE(MatrixNear(contact.normal, -cylinder.Evaluate(expected.alpha).R.col(2), 1e-15));
  }
  for (const int count : {inside, side, end, rim}) EXPECT_GT(count, 100);
}

TEST(CylinderCollision, HasAResultOnTheAxisAndAtTheRim) {
  for (const Vector3d& center :
       {Vector3d(0.0, 0.0, 0.0), Vector3d(0.0, 0.0, kHalfLength), Vector3d(kRadius, 0.0, kHalfLength)}) {
    const ExactContact contact = CollideSphereCylinder(center, kBall, kRadius, kHalfLength);
    EXPECT_NEAR(contact.normal.norm(), 1.0, 1e-15);
    EXPECT_LE(contact.distance, -kBall);
  }
}

TEST(CylinderCollision, IsTheEnginesToRounding) {
  const MjModelPtr model = LoadMjcfText(
      R"(<mujoco><worldbody><body><freejoint/><geom type="cylinder" size="0.05 0.03"/></body>)"
      R"(<body pos="0.0551 0.006 0.01"><freejoint/><geom type="sphere" size="0.01"/></body></worldbody>)"
      "</mujoco>",
      "ball at a cylinder");
  const MjDataPtr data = MakeData(*model);
  const Vector3d center(0.0551, 0.006, 0.01);
  mj_fwdPosition(model.get(), data.get());
  ASSERT_EQ(data->ncon, 1);
  const mjContact& contact = data->contact[0];
  const ExactContact expected = CollideSphereCylinder(center, kBall, kRadius, kHalfLength);
  EXPECT_LT(expected.distance, 0.0);
  EXPECT_NEAR(contact.dist, expected.distance, kRounding);
  EXPECT_TRUE(MatrixNear(Eigen::Map<const Vector3d>(contact.pos), expected.position, 1e-15));
  EXPECT_TRUE(MatrixNear(Eigen::Map<const Vector3d>(contact.frame), expected.normal, 1e-15));
  // Beyond reach there is none.
  data->qpos[7] = 0.0602 + 0.001;
  mj_fwdPosition(model.get(), data.get());
  EXPECT_EQ(data->ncon, 0);
}

// The nearest point, against the controller's side, which finds it by another method.
TEST(EllipsoidCollision, FindsTheNearestPointsOutsideAndIn) {
  const Vector3d axes(0.05, 0.03, 0.04);
  const Ellipsoid surface(axes);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> draw(-0.1, 0.1);
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d center(draw(random), draw(random), draw(random));
    const ExactContact contact = CollideSphereEllipsoid(center, kBall, axes);
    const SurfaceProjection projection = surface.Project(center);
    const SurfaceGeometry place = surface.Evaluate(projection.alpha);
    ASSERT_NEAR(contact.distance, projection.distance - kBall, 10.0 * kRounding);
    ASSERT_TRUE(MatrixNear(contact.normal, Vector3d(-place.R.col(2)), 1e-12));
    const Vector3d on_ellipsoid = contact.position + 0.5 * contact.distance * contact.normal;
    ASSERT_NEAR(on_ellipsoid.cwiseQuotient(axes).norm(), 1.0, 1e-12);
    inside += projection.distance < 0.0 ? 1 : 0;
  }
  EXPECT_GT(inside, 20);
  EXPECT_NEAR(CollideSphereEllipsoid(Vector3d::Zero(), kBall, axes).distance, -0.03 - kBall, kRounding);
}

}  // namespace
}  // namespace dexcheck::testing::cylinder_collision_test
