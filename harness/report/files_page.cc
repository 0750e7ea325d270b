#include "harness/report/files_page.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "harness/report/page_frame.h"

namespace dexcheck {
namespace {

using Json = nlohmann::ordered_json;

Json ListEntries(const Vector3d& v) { return {v[0], v[1], v[2]}; }

/// Position, m, and quaternion w, x, y, z.
Json DescribePose(const Pose& X) {
  const Vector4d q = ToQuaternion(X.linear());
  return {{"position", ListEntries(X.translation())}, {"quaternion", {q[0], q[1], q[2], q[3]}}};
}

/// The ellipsoid of even density that has an inertial's mass m and principal moments I: its semi-axes a
/// follow from I_x = m (a_y^2 + a_z^2) / 5. Where no such body exists, the axis is 0.
Json MakeEllipsoid(const PrintedInertial& inertial) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(ToTensor(inertial.I));
  const Vector3d& moments = principal.eigenvalues();
  Matrix3d axes = principal.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) = -axes.col(0);
  Pose X = inertial.origin.CalcPose();
  X.linear() = X.linear() * axes;
  Vector3d size = Vector3d::Zero();
  for (int i = 0; i < 3 && inertial.mass.value > 0.0; ++i) {
    const double square = 2.5 * (moments.sum() - 2.0 * moments[i]) / inertial.mass.value;
    size[i] = std::sqrt(std::max(square, 0.0));
  }
  Json json = DescribePose(X);
  json["size"] = ListEntries(size);
  json["mass"] = inertial.mass.value;
  return json;
}

Json DescribeRobot(const PrintedRobot& robot) {
  static constexpr std::array<const char*, 5> kKinds = {"fixed", "hinge", "slide", "ball", "free"};
  Json links = Json::array();
  for (const PrintedLink& link : robot.links) {
    Json& json = links.emplace_back(DescribePose(link.origin.CalcPose()));
    json["name"] = link.name;
    json["joint"] = link.joint.name;
    json["parent"] = link.parent;
    json["kind"] = kKinds[static_cast<size_t>(link.joint.kind)];
    json["axis"] = ListEntries(link.joint.axis);
    json["anchor"] = ListEntries(link.joint.anchor);
    if (link.joint.range) {
      const auto& [lower, upper] = *link.joint.range;
      json["range"] = {lower.value, upper.value};
    }
    if (link.inertial) json["ellipsoid"] = MakeEllipsoid(*link.inertial);
  }
  return {{"file", std::filesystem::path(robot.source).filename().string()}, {"links", links}};
}

}  // namespace

std::string MakeFilesPage(const PrintedRobot& first, const PrintedRobot& second, const Json& result) {
  const Json robots = {DescribeRobot(first), DescribeRobot(second)};
  return AssemblePage(
      {.title = robots[0]["file"].get<std::string>() + " and " + robots[1]["file"].get<std::string>(),
       .styles = {},
       .markup = {kPageHtml},
       .data = EmbedJson("result", result) + EmbedJson("robots", robots),
       .scripts = {kThreeJs, kFilesJs}});
}

}  // namespace dexcheck
