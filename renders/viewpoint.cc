#include "renders/viewpoint.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/map_vector.h"

namespace dexcheck {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

long RunFrames::RowAt(double time) const {
  const auto after = std::ranges::upper_bound(times, time);
  return std::max(0L, static_cast<long>(after - times.begin()) - 1);
}

void CheckRunFrames(const mjModel& model, const RunFrames& run) {
  const auto fail = [&](const std::string& what) { throw InputError(run.source + ": " + what); };
  const long n = run.rows();
  if (n == 0) fail("time: the run has no recorded instants");
  for (long i = 0; i < n; ++i) {
    const double time = run.times[static_cast<size_t>(i)];
    if (!std::isfinite(time)) fail("time: row " + std::to_string(i) + " is not finite");
    if (i > 0 && !(time > run.times[static_cast<size_t>(i - 1)])) {
      fail("time: must increase, got " + FormatNumber(time) + " in row " + std::to_string(i));
    }
  }
  if (n == 1) fail("time: the run ends where it begins, at " + FormatNumber(run.times.front()) + " s");
  const auto check_size = [&](const std::string& key, long rows, long columns, long columns_expected) {
    if (rows == n && columns == columns_expected) return;
    fail(key + ": must be " + std::to_string(n) + " x " + std::to_string(columns_expected) + ", got " +
         std::to_string(rows) + " x " + std::to_string(columns));
  };
  const auto check_matrix = [&](const std::string& key, const RowMatrixXd& matrix, long columns) {
    if (matrix.size() > 0) check_size(key, matrix.rows(), matrix.cols(), columns);
  };
  const auto check_series = [&](const std::string& key, const std::vector<double>& series) {
    if (!series.empty()) check_size(key, static_cast<long>(series.size()), 1, 1);
  };
  check_size("qpos", run.qpos.rows(), run.qpos.cols(), model.nq);
  if (!run.qpos.allFinite()) fail("qpos: is not finite");
  check_series("position error", run.position_errors);
  check_series("orientation error", run.orientation_errors);
  check_series("joint error", run.joint_errors);
  for (const CheckSeries& check : run.checks) {
    check_size("check " + check.name, static_cast<long>(check.residuals.size()), 1, 1);
  }
  const long contact_columns = 3 * run.contacts();
  check_matrix("contact positions", run.contact_positions, contact_columns);
  check_matrix("contact forces", run.contact_forces, contact_columns);
  check_matrix("contact normals", run.contact_normals, contact_columns);
  check_matrix("desired positions", run.desired_positions, 3);
  check_matrix("desired angles", run.desired_angles, 3);
}

void SetRow(const mjModel& model, const RunFrames& run, long row, mjData* data) {
  mju_copy(data->qpos, run.qpos.row(row).data(), static_cast<int>(model.nq));
  mj_kinematics(&model, data);
  mj_comPos(&model, data);
  mj_camlight(&model, data);
}

Vector3d ContactVector(const RowMatrixXd& rows, long row, long contact) {
  return rows.block<1, 3>(row, 3 * contact).transpose();
}

double CalcMetersPerNewton(const RunFrames& run) {
  constexpr double kLongestForce = 0.042;  // m, suits a hand
  double largest = 0.0;
  for (long row = 0; row < run.contact_forces.rows(); ++row) {
    for (long k = 0; k < run.contact_forces.cols() / 3; ++k) {
      const double size = ContactVector(run.contact_forces, row, k).norm();
      if (std::isfinite(size)) largest = std::max(largest, size);
    }
  }
  return largest > 0.0 ? kLongestForce / largest : 1.0;
}

CheckHistory::CheckHistory(const RunFrames& run) : run_(run) {
  for (const CheckSeries& check : run.checks) {
    std::vector<double>& worst = worst_.emplace_back();
    worst.reserve(check.residuals.size());
    double largest = 0.0;
    for (const double residual : check.residuals) {
      largest = std::max(largest, std::abs(residual));
      if (std::isnan(residual)) largest = kInfinity;
      worst.push_back(largest);
    }
  }
}

std::vector<CategoryStatus> CheckHistory::ListCategories(long row) const {
  std::vector<CategoryStatus> categories;
  if (run_.checks.empty()) return categories;
  for (const CheckCategory kind : kCheckCategories) {
    CategoryStatus& status = categories.emplace_back(CategoryStatus{kind});
    for (size_t i = 0; i < worst_.size(); ++i) {
      const CheckSeries& check = run_.checks[i];
      if (check.kind != kind) continue;
      CheckRecord record{.name = check.name, .kind = kind, .bound = check.bound};
      record.Add(worst_[i][static_cast<size_t>(row)], 0.0);
      status.Add(record);
    }
  }
  return categories;
}

namespace {

/// Along one side vector s of the picture and the axis f, a sphere is between the edges of a camera at c when
///   s.(p - c) + radius sqrt(1 + high^2) <=  high f.(p - c)
///   s.(p - c) - radius sqrt(1 + low^2)  >= -low  f.(p - c)
/// so that  s.c - high f.c >= floor  and  s.c + low f.c <= ceiling.
struct Slab {
  double low, high;
  double floor = -std::numeric_limits<double>::infinity();
  double ceiling = std::numeric_limits<double>::infinity();

  void Include(double along, double depth, double radius) {
    floor = std::max(floor, along - high * depth + radius * std::hypot(1.0, high));
    ceiling = std::min(ceiling, along + low * depth - radius * std::hypot(1.0, low));
  }
  /// Largest f.c.
  [[nodiscard]] double nearest() const { return (ceiling - floor) / (low + high); }
  /// s.c in the middle of what is allowed at f.c = depth.
  [[nodiscard]] double FindMiddle(double depth) const {
    return 0.5 * (floor + high * depth + ceiling - low * depth);
  }
};

/// From one point to another, which must not be the same.
Viewpoint LookFrom(const Vector3d& eye, const Vector3d& look_at) {
  const Vector3d way = look_at - eye;
  return {look_at, way.norm(), std::atan2(way.y(), way.x()),
          std::asin(std::clamp(way.z() / way.norm(), -1.0, 1.0))};
}

constexpr long kMostRows = 60;
constexpr double kLeastWay = 0.3;             // m; a shorter way has no direction
constexpr double kBearing = DegToRad(148.0);  // of the view, from the way's direction
constexpr double kElevation = DegToRad(-14.0);
constexpr double kLeastRadius = 0.01;  // m, of a body that is seen from near by
constexpr double kRoom = 1.9;          // of its radius, from its centre to the picture's upper edge

/// By body: whether it can move, or carries a body that can, as the fixed link of an arm does.
std::vector<bool> ListRobotBodies(const mjModel& model) {
  std::vector<bool> bodies(static_cast<size_t>(model.nbody), false);
  for (int body = model.nbody - 1; body > 0; --body) {  // a parent comes before its children
    const auto at = static_cast<size_t>(body);
    bodies[at] = bodies[at] || model.body_weldid[body] != 0;
    if (bodies[at]) bodies[static_cast<size_t>(model.body_parentid[body])] = true;
  }
  bodies[0] = false;  // the world
  return bodies;
}

/// Adds all geoms of a robot or an object. @return the mean of their places.
Vector3d AddMovingGeoms(const mjModel& model, const mjData& data, std::vector<VisibleSphere>* spheres) {
  Vector3d sum = Vector3d::Zero();
  const size_t before = spheres->size();
  const std::vector<bool> bodies = ListRobotBodies(model);
  for (int geom = 0; geom < model.ngeom; ++geom) {
    const bool is_shown = bodies[static_cast<size_t>(model.geom_bodyid[geom])];
    if (!is_shown || model.geom_type[geom] == mjGEOM_PLANE) continue;
    spheres->push_back({Vector3d(data.geom_xpos + 3 * geom), model.geom_rbound[geom]});
    sum += spheres->back().center;
  }
  return sum / static_cast<double>(std::max<size_t>(spheres->size() - before, 1));
}

}  // namespace

Viewpoint FitViewpoint(std::span<const VisibleSphere> spheres, double azimuth, double elevation,
                       const ViewEdges& edges) {
  Require(!spheres.empty(), "spheres", "must be at least one", 0.0);
  const Vector3d forward(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                         std::sin(elevation));
  const Vector3d right(std::sin(azimuth), -std::cos(azimuth), 0.0);
  const Vector3d up = right.cross(forward);
  Slab across{edges.left, edges.right};
  Slab upwards{edges.bottom, edges.top};
  double middle = 0.0;
  for (const VisibleSphere& sphere : spheres) {
    const double depth = forward.dot(sphere.center);
    across.Include(right.dot(sphere.center), depth, sphere.radius);
    upwards.Include(up.dot(sphere.center), depth, sphere.radius);
    middle += depth / static_cast<double>(spheres.size());
  }
  const double depth = std::min(across.nearest(), upwards.nearest());
  const Vector3d camera = depth * forward + across.FindMiddle(depth) * right + upwards.FindMiddle(depth) * up;
  return {camera + (middle - depth) * forward, middle - depth, azimuth, elevation};
}

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
