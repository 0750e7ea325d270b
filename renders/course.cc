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

}  // namespace

Viewpoint FindCourse(const mjModel& model, const RunFrames& run, const ViewEdges& edges, mjData* data) {
  std::vector<VisibleSphere> spheres;
  const auto add_row = [&](long row) {
    SetRow(model, run, row, data);
    Vector3d sum = Vector3d::Zero();
    const size_t before = spheres.size();
    for (int geom = 0; geom < model.ngeom; ++geom) {
      const bool moves = model.body_weldid[model.geom_bodyid[geom]] != 0;
      if (!moves || model.geom_type[geom] == mjGEOM_PLANE) continue;
      spheres.push_back({Vector3d(data->geom_xpos + 3 * geom), model.geom_rbound[geom]});
      sum += spheres.back().center;
    }
    return Vector3d(sum / static_cast<double>(std::max<size_t>(spheres.size() - before, 1)));
  };
  const Vector3d first = add_row(0);
  const long stride = (run.rows() + kMostRows - 1) / kMostRows;
  for (long row = stride; row < run.rows(); row += stride) add_row(row);
  const Vector3d way = add_row(run.rows() - 1) - first;
  const double heading = way.head<2>().norm() > kLeastWay ? std::atan2(way.y(), way.x()) : 0.0;
  return FitViewpoint(spheres, heading + kBearing, kElevation, edges);
}

}  // namespace dexcheck
