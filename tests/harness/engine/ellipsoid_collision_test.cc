// The exact sphere-ellipsoid narrow phase, by itself and inside the engine.

#include "harness/engine/ellipsoid_collision.h"

#include <gtest/gtest.h>

#include <random>

#include "controller/contact/shapes.h"
#include "harness/engine/engine.h"
#include "tests/common/matrix_near.h"

namespace dexcheck {
namespace {

using testing::MatrixNear;

const Vector3d kSemiAxes(0.05, 0.03, 0.04);
constexpr double kBall = 0.01;
constexpr double kRounding = 1e-15;  // m: positions of some 0.1 m, formed in a dozen operations

TEST(EllipsoidCollision, FindsTheNearestPoint) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> draw(-0.1, 0.1);
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d center(draw(random), draw(random), draw(random));
    const SphereEllipsoidContact contact = CollideSphereEllipsoid(center, kBall, kSemiAxes);
    ASSERT_NEAR(contact.normal.norm(), 1.0, 4e-16);
    const Vector3d on_surface = contact.position + 0.5 * contact.distance * contact.normal;
    ASSERT_NEAR(on_surface.cwiseQuotient(kSemiAxes).norm(), 1.0, 1e-13);
    const Vector3d gradient = on_surface.cwiseQuotient(kSemiAxes.cwiseAbs2()).normalized();
    ASSERT_TRUE(MatrixNear(contact.normal, -gradient, 1e-12));
    // No other point of the surface is nearer.
    const bool is_inside = center.cwiseQuotient(kSemiAxes).norm() < 1.0;
    inside += is_inside ? 1 : 0;
    const double nearest = std::abs(contact.distance + kBall);
    for (int k = 0; k < 20; ++k) {
      const double u = angle(random), v = 0.5 * angle(random);
      const Vector3d other(kSemiAxes.x() * std::cos(v) * std::cos(u),
                           kSemiAxes.y() * std::cos(v) * std::sin(u), kSemiAxes.z() * std::sin(v));
      ASSERT_LE(nearest, (center - other).norm() + kRounding);
    }
    ASSERT_EQ(is_inside, contact.distance + kBall < 0.0);
  }
  EXPECT_GT(inside, 50);
}

TEST(EllipsoidCollision, IsTheControllersSurfaceInTheEngine) {
  const std::string mjcf = R"(<mujoco><option collision="predefined"/><worldbody>
    <geom name="egg" type="ellipsoid" size="0.05 0.03 0.04" pos="0.1 0.2 0.3" euler="20 30 40" contype="0" conaffinity="0"/>
    <body pos="0.13 0.22 0.335"><freejoint/><geom name="ball" size="0.01" contype="0" conaffinity="0"/></body>
    </worldbody><contact><pair geom1="ball" geom2="egg" margin="0.1"/></contact></mujoco>)";
  const MjModelPtr model = LoadMjcfText(mjcf, "egg.xml");
  const MjDataPtr data = MakeData(*model);
  mj_forward(model.get(), data.get());
  ASSERT_EQ(data->ncon, 1);
  const int egg = mj_name2id(model.get(), mjOBJ_GEOM, "egg");
  const int ball = mj_name2id(model.get(), mjOBJ_GEOM, "ball");
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(data->geom_xmat + 9 * egg);
  const Vector3d center = R.transpose() * (Eigen::Map<const Vector3d>(data->geom_xpos + 3 * ball) -
                                           Eigen::Map<const Vector3d>(data->geom_xpos + 3 * egg));
  const Ellipsoid surface(kSemiAxes);
  const SurfaceProjection nearest = surface.Project(center);
  EXPECT_NEAR(data->contact[0].dist, nearest.distance - kBall, 1e-15);
  const Vector3d normal = R.transpose() * Eigen::Map<const Vector3d>(data->contact[0].frame);
  const double sign = data->contact[0].geom1 == ball ? -1.0 : 1.0;
  EXPECT_TRUE(MatrixNear(sign * normal, surface.Evaluate(nearest.alpha).R.col(2), 1e-13));
}

}  // namespace
}  // namespace dexcheck
