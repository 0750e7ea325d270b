// The plant's sphere-torus contact against closed form, the engine's own capsules, and the hole.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "controller/contact/shapes.h"
#include "harness/engine/engine.h"
#include "harness/engine/exact_collision.h"
#include "harness/engine/mujoco_release.h"
#include "tests/common/matrix_near.h"
#include "tests/common/paths.h"

namespace dexcheck::testing::torus_collision_test {
namespace {

constexpr double kRing = 0.035;
constexpr double kTube = 0.011;
constexpr double kBall = 0.009;

// Positions of some 0.1 m, formed in a dozen operations.
constexpr double kRounding = 1e-15;

/// A torus mesh (with or without the mark that makes it exact) and a ball, each with a free joint.
MjModelPtr LoadBallAndTorus(double ball_radius, bool exact, bool torus_fixed = false) {
  return LoadMjcfText(fmt::format(R"(<mujoco><size nuser_geom="2"/><compiler meshdir="{}/mjcf/assets"/>
        <option timestep="0.001"/>
        <asset><mesh name="torus" file="torus.msh"/></asset><worldbody>
        <body name="torus">{}<inertial pos="0 0 0" mass="0.2" diaginertia="1e-4 1e-4 2e-4"/>
          <geom name="torus" type="mesh" mesh="torus" mass="0" {}/></body>
        <body name="ball" pos="0 0 1"><freejoint/><geom name="ball" type="sphere" size="{}" mass="0.01"/></body>
        </worldbody></mujoco>)",
                                  SourcePath(), torus_fixed ? "" : "<freejoint/>",
                                  exact ? R"(user="0.035 0.011")" : "", ball_radius),
                      "ball and torus");
}

TEST(CollideSphereTorus, AgreesWithTheSurfacesClosestPoint) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(-0.06, 0.06);
  const Torus torus(kRing, kTube);
  int touching = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d center(draw(random), draw(random), draw(random));
    const SurfaceProjection expected = torus.Project(center);
    ExactContact contacts[2];
    const int count = CollideSphereTorus(center, kBall, kRing, kTube, 0.002, contacts);
    const double distance = expected.distance - kBall;
    ASSERT_EQ(count > 0, distance <= 0.002);
    if (count == 0) continue;
    ++touching;
    const SurfaceGeometry surface = torus.Evaluate(expected.alpha);
    EXPECT_NEAR(contacts[0].distance, distance, kRounding);
    // Inside the tube the normal still points from the ball to the ring's circle.
    EXPECT_TRUE(MatrixNear(contacts[0].normal, -surface.R.col(2), 1e-12));
    EXPECT_TRUE(
        MatrixNear(contacts[0].position, surface.p + 0.5 * distance * surface.R.col(2), 10.0 * kRounding));
  }
  EXPECT_GT(touching, 200);
}

TEST(CollideSphereTorus, BallInTheHoleTouchesBothSides) {
  ExactContact contacts[2];
  // On the axis, a ball of the hole's radius touches at distance 0 on opposite sides.
  ASSERT_EQ(CollideSphereTorus(Vector3d::Zero(), kRing - kTube, kRing, kTube, 1e-9, contacts), 2);
  EXPECT_TRUE(MatrixNear(contacts[0].normal, -contacts[1].normal, kRounding));
  EXPECT_NEAR(contacts[0].distance, 0.0, kRounding);
  EXPECT_NEAR(contacts[1].distance, 0.0, kRounding);
}

double HeightAfterFall(bool exact) {
  const MjModelPtr model = LoadBallAndTorus(kBall, exact, /*torus_fixed=*/true);
  const MjDataPtr data = MakeData(*model);
  data->qpos[2] = 0.1;
  while (data->time < 0.5) mj_step(model.get(), data.get());
  return data->qpos[2];
}

TEST(TorusCollision, BallFallsThroughTheHole) {
  // Free fall from 0.1 m for 0.5 s ends at 0.1 - g t^2 / 2 = -1.13 m (Euler's first step adds g t dt / 2).
  EXPECT_NEAR(HeightAfterFall(true), 0.1 - 0.5 * 9.81 * 0.25, 0.005);
  // Without the mark the same mesh is its convex hull: the ball stays on it.
  EXPECT_GT(HeightAfterFall(false), 0.0);
}

// The visible shape of the shipped objects is their contact shape: the meshes' vertices lie on the surface
// that the mark describes, in the body's frame.
TEST(TorusCollision, ShippedMeshesShowTheSurface) {
  constexpr double kFloats = 1e-6;  // coordinates of some 0.3 m as floats, and the engine's own rotation
  for (const char* scene : {"scene.xml", "ring_scene.xml"}) {
    const MjModelPtr model = LoadMjcf(SourcePath("/mjcf/") + scene);
    const int geom = mj_name2id(model.get(), mjOBJ_GEOM, "torus_geom");
    double ring_radius = 0.0;
    double tube_radius = 0.0;
    ASSERT_TRUE(GetTorusRadii(*model, geom, &ring_radius, &tube_radius)) << scene;
    const Torus torus(ring_radius, tube_radius);
    const mjtNum* const p = model->geom_pos + 3 * geom;
    const mjtNum* const q = model->geom_quat + 4 * geom;
    const Eigen::Quaterniond R(q[0], q[1], q[2], q[3]);
    const int mesh = model->geom_dataid[geom];
    const float* const vertices = model->mesh_vert + 3 * model->mesh_vertadr[mesh];
    double worst = 0.0;
    for (int i = 0; i < model->mesh_vertnum[mesh]; ++i) {
      const Vector3d vertex = Eigen::Map<const Eigen::Vector3f>(vertices + 3 * i).cast<double>();
      const Vector3d in_body = R * vertex + Vector3d(p[0], p[1], p[2]);
      worst = std::max(worst, std::abs(torus.Project(in_body).distance));
    }
    EXPECT_GE(model->mesh_vertnum[mesh], 1000) << scene;
    EXPECT_LE(worst, kFloats) << scene;
  }
}

/// Every ball of the ring against the box, far more of them than the contacts. In plain numbers, since there
/// are millions.
double MeasureGap(const Pose& X_BT, const Vector3d& half_size) {
  double gap = 1.0;
  for (int i = 0; i < 7200; ++i) {
    const double u = 2.0 * kPi * i / 7200;
    const double x = kRing * std::cos(u);
    const double y = kRing * std::sin(u);
    double beyond = 0.0;
    double inside = -1.0;
    for (int k = 0; k < 3; ++k) {
      const double* const row = X_BT.data() + k;  // of a matrix stored by columns of four
      const double past = std::abs(row[0] * x + row[4] * y + row[12]) - half_size.data()[k];
      if (past > 0.0) beyond += past * past;
      if (past > inside) inside = past;
    }
    gap = std::min(gap, std::sqrt(beyond) + std::min(0.0, inside) - kTube);
  }
  return gap;
}

TEST(CollideBoxTorus, FindsTheLowestPlaceOfATorusOnAFace) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> draw(-1.0, 1.0);
  const Vector3d half_size(0.5, 0.4, 0.02);
  int touching = 0;
  for (int i = 0; i < 500; ++i) {
    Pose X_BT = Pose::Identity();
    const Vector3d axis = Vector3d(draw(random), draw(random), draw(random)).normalized();
    X_BT.linear() = Eigen::AngleAxisd(0.5 * draw(random), axis).toRotationMatrix();
    X_BT.translation() = Vector3d(0.3 * draw(random), 0.2 * draw(random), 0.05 + 0.02 * draw(random));
    ExactContact contacts[kRingPlaces];
    const int count = CollideBoxTorus(X_BT, kRing, kTube, half_size, 0.002, contacts);
    const double gap = MeasureGap(X_BT, half_size);
    ASSERT_EQ(count > 0, gap <= 0.002) << gap;
    if (count == 0) continue;
    ++touching;
    double nearest = 1.0;
    for (int k = 0; k < count; ++k) {
      nearest = std::min(nearest, contacts[k].distance);
      EXPECT_TRUE(MatrixNear(contacts[k].normal, Vector3d::UnitZ(), 0.0));
      // Midway between the face and the tube.
      EXPECT_NEAR(contacts[k].position.z(), half_size.z() + 0.5 * contacts[k].distance, 1e-15);
    }
    // The fine ring has a place within 5e-4 rad of the lowest.
    EXPECT_NEAR(nearest, gap, kRing * 5e-4 * 5e-4);
  }
  EXPECT_GT(touching, 100);
}

TEST(CollideBoxTorus, SupportsAFlatTorusAllAround) {
  Pose X_BT = Pose::Identity();
  X_BT.translation().z() = 0.02 + kTube - 1e-6;
  ExactContact contacts[kRingPlaces];
  ASSERT_EQ(CollideBoxTorus(X_BT, kRing, kTube, Vector3d(0.5, 0.4, 0.02), 0.0, contacts), kRingPlaces);
  Vector3d middle = Vector3d::Zero();
  for (const ExactContact& contact : contacts) {
    EXPECT_NEAR(contact.distance, -1e-6, 1e-15);
    EXPECT_NEAR(contact.position.head<2>().norm(), kRing, 1e-15);
    middle += contact.position / kRingPlaces;
  }
  EXPECT_NEAR(middle.head<2>().norm(), 0.0, 1e-15);
}

TEST(CollideBoxTorus, HangsOnAnEdgeAndFallsBesideTheBox) {
  const Vector3d half_size(0.5, 0.4, 0.02);
  ExactContact contacts[kRingPlaces];
  Pose X_BT = Pose::Identity();
  // Half of the ring is over the box.
  X_BT.translation() = Vector3d(0.5, 0.0, 0.02 + kTube);
  const int count = CollideBoxTorus(X_BT, kRing, kTube, half_size, 1e-6, contacts);
  EXPECT_GT(count, 2);
  EXPECT_LT(count, kRingPlaces);
  X_BT.translation().x() = 0.5 + kRing + kTube + 1e-3;
  EXPECT_EQ(CollideBoxTorus(X_BT, kRing, kTube, half_size, 0.0, contacts), 0);
}

TEST(TorusInTheEngine, LiesStillOnABox) {
  InstallExactCollision();
  const MjModelPtr model =
      LoadMjcfText(fmt::format(R"(<mujoco><size nuser_geom="2"/><compiler meshdir="{}/mjcf/assets"/>
        <option timestep="0.001" cone="elliptic"/>
        <asset><mesh name="torus" file="torus.msh"/></asset><worldbody>
        <geom name="top" type="box" size="0.5 0.4 0.02"/>
        <body name="torus" pos="0.1 0.05 0.0312"><freejoint/>
          <inertial pos="0 0 0" mass="0.2" diaginertia="0.000137625 0.000137625 0.00026315"/>
          <geom name="torus" type="mesh" mesh="torus" mass="0" user="0.035 0.011"/></body>
        </worldbody></mujoco>)",
                               SourcePath()),
                   "torus on a box");
  const MjDataPtr data = MakeData(*model);
  for (int i = 0; i < 2000; ++i) mj_step(model.get(), data.get());
  double weight = 0.0;
  for (int i = 0; i < data->ncon; ++i) {
    mjtNum force[6];
    mj_contactForce(model.get(), data.get(), i, force);
    weight += force[0];
  }
  const int contacts = std::min(kRingPlaces, CountMostContacts(*model, 0, 1, 0.0));
  EXPECT_GE(contacts, 4);
  EXPECT_EQ(data->ncon, contacts);
  EXPECT_NEAR(weight, 0.2 * 9.81, 1e-6);
  EXPECT_LT(Eigen::Map<const VectorXd>(data->qvel, 6).norm(), 1e-9);
  // Each contact sinks in with the weight that it bears, 5.4e-5 m of eight.
  EXPECT_NEAR(data->qpos[2], 0.02 + kTube, 1e-4 * kRingPlaces / contacts);
}

}  // namespace
}  // namespace dexcheck::testing::torus_collision_test
