// A viewpoint has all in the picture, and is as near as that allows.

#include "renders/viewpoint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace dexcheck::testing::viewpoint_test {
namespace {

constexpr double kRounding = 1e-12;  // m, of numbers of size 10

/// How far the spheres stay away from the edges, m: the least of all edges and spheres, for a camera that
/// stands `closer` further ahead.
double FindClearance(const std::vector<VisibleSphere>& spheres, const Viewpoint& view, const ViewEdges& edges,
                     double closer) {
  const Matrix3d R = (Eigen::AngleAxisd(view.azimuth, Vector3d::UnitZ()) *
                      Eigen::AngleAxisd(-view.elevation, Vector3d::UnitY()))
                         .toRotationMatrix();
  const Vector3d forward = R.col(0);
  const Vector3d left = R.col(1);
  const Vector3d up = R.col(2);
  const Vector3d camera = view.look_at - (view.distance - closer) * forward;
  double clearance = 1e9;
  const auto include = [&](const Vector3d& side, double tangent, const VisibleSphere& sphere) {
    // Distance from the plane through the camera that the edge is.
    const Vector3d inwards = (tangent * forward - side).normalized();
    clearance = std::min(clearance, inwards.dot(sphere.center - camera) - sphere.radius);
  };
  for (const VisibleSphere& sphere : spheres) {
    include(left, edges.left, sphere);
    include(-left, edges.right, sphere);
    include(-up, edges.bottom, sphere);
    include(up, edges.top, sphere);
  }
  return clearance;
}

TEST(FitViewpoint, HasAllInThePictureAndNoRoomToSpare) {
  std::mt19937 random(3);
  const auto draw = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 100; ++i) {
    std::vector<VisibleSphere> spheres;
    for (int k = 0; k < 1 + i % 20; ++k) {
      spheres.push_back({{draw(-5, 5), draw(-5, 5), draw(0, 2)}, draw(0.01, 0.5)});
    }
    const ViewEdges edges = {draw(0.1, 0.8), draw(0.1, 0.8), draw(0.1, 0.8), draw(0.1, 0.8)};
    const Viewpoint view = FitViewpoint(spheres, draw(-kPi, kPi), draw(-1.4, 0.3), edges);
    EXPECT_NEAR(FindClearance(spheres, view, edges, 0.0), 0.0, kRounding) << i;
    EXPECT_LT(FindClearance(spheres, view, edges, 0.01), -1e-4) << "nearer is too near";
  }
}

}  // namespace
}  // namespace dexcheck::testing::viewpoint_test
