#include "renders/course.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "renders/run_decorations.h"

namespace dexcheck {
namespace {

constexpr long kMostRows = 60;
constexpr double kLeastWay = 0.3;             // m; a shorter way has no direction
constexpr double kBearing = DegToRad(148.0);  // of the view, from the way's direction
constexpr double kElevation = DegToRad(-14.0);
constexpr double kLeastRadius = 0.01;  // m, of a body that is seen from near by
constexpr double kRoom = 1.9;          // of its radius, from its centre to the picture's upper edge

/// Adds all geoms that can move. @return the mean of their places.
Vector3d AddMovingGeoms(const mjModel& model, const mjData& data, std::vector<VisibleSphere>* spheres) {
  Vector3d sum = Vector3d::Zero();
  const size_t before = spheres->size();
  for (int geom = 0; geom < model.ngeom; ++geom) {
    const bool moves = model.body_weldid[model.geom_bodyid[geom]] != 0;
    if (!moves || model.geom_type[geom] == mjGEOM_PLANE) continue;
    spheres->push_back({Vector3d(data.geom_xpos + 3 * geom), model.geom_rbound[geom]});
    sum += spheres->back().center;
  }
  return sum / static_cast<double>(std::max<size_t>(spheres->size() - before, 1));
}

}  // namespace

Way FindWay(const mjModel& model, const RunFrames& run, mjData* data) {
  const auto find_middle = [&](long row) {
    SetRow(model, run, row, data);
    std::vector<VisibleSphere> spheres;
    return AddMovingGeoms(model, *data, &spheres);
  };
  const Vector3d first = find_middle(0);
  const Vector3d way = find_middle(run.rows() - 1) - first;
  const double length = way.head<2>().norm();
  return {length, kBearing + (length > kLeastWay ? std::atan2(way.y(), way.x()) : 0.0)};
}

Viewpoint FindCourse(const mjModel& model, const RunFrames& run, const ViewEdges& edges, mjData* data) {
  const Way way = FindWay(model, run, data);
  std::vector<VisibleSphere> spheres;
  const long stride = (run.rows() + kMostRows - 1) / kMostRows;
  for (long row = 0; row < run.rows(); row += stride) {
    SetRow(model, run, row, data);
    AddMovingGeoms(model, *data, &spheres);
  }
  SetRow(model, run, run.rows() - 1, data);
  AddMovingGeoms(model, *data, &spheres);
  return FitViewpoint(spheres, way.bearing, kElevation, edges);
}

Viewpoint FindInstant(const mjModel& model, double bearing, const ViewEdges& edges, const mjData& data) {
  std::vector<VisibleSphere> spheres;
  AddMovingGeoms(model, data, &spheres);
  return FitViewpoint(spheres, bearing, kElevation, edges);
}

Viewpoint FindCloseUp(const mjModel& model, int body, const Vector3d& from, const mjData& data) {
  const Vector3d center = BodyPose(data, body).translation();
  double radius = kLeastRadius;
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_bodyid[geom] != body) continue;
    const Vector3d p(data.geom_xpos + 3 * geom);
    radius = std::max(radius, (p - center).norm() + model.geom_rbound[geom]);
  }
  const double distance = kRoom * radius / std::tan(0.5 * DegToRad(model.vis.global.fovy));
  return LookFrom(center + distance * (from - center).normalized(), center);
}

}  // namespace dexcheck
