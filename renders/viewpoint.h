#pragma once

// Viewpoints from which all of something is in the picture.

#include <mujoco/mujoco.h>

#include <span>
#include <string>
#include <vector>

#include "controller/common/types.h"
#include "harness/base/check_record.h"

namespace dexcheck {

/// One check over a run.
struct CheckSeries {
  std::string name;
  CheckCategory kind = CheckCategory::kModel;
  double bound = 0.0;
  std::vector<double> residuals;  ///< One a row; what is not a number counts as infinite.
};

/// Data of a run for a video: n rows, one a recorded instant. Everything but times and qpos may be empty.
struct RunFrames {
  std::string source;       ///< The run's folder or file, for messages.
  std::string title;        ///< Name of the scenario.
  std::string object_body;  ///< Of what is held.

  std::vector<double> times;  ///< s, increasing; n.
  RowMatrixXd qpos;           ///< n x nq.

  std::vector<std::string> phases;  ///< What a task is at; n.

  std::vector<double> position_errors;     ///< Of the object, m; n.
  std::vector<double> orientation_errors;  ///< rad; n.
  std::vector<double> joint_errors;        ///< Of the joint that is farthest off, rad; n.
  std::vector<CheckSeries> checks;

  RowMatrixXd contact_positions;  ///< n x 3N, m, world; NaN where a contact is open.
  RowMatrixXd contact_forces;     ///< n x 3N, N, world, of the finger on the object.
  RowMatrixXd contact_normals;    ///< n x 3N, world, into the object.
  double friction = 0.0;          ///< Coefficient mu of the fingertips.

  RowMatrixXd desired_positions;  ///< n x 3, m, world: where the object should be.
  RowMatrixXd desired_angles;     ///< n x 3, rad: ZYZ angles that it should have there.

  [[nodiscard]] long rows() const { return static_cast<long>(times.size()); }
  [[nodiscard]] double duration() const { return times.back() - times.front(); }  ///< s.
  [[nodiscard]] long contacts() const { return contact_positions.cols() / 3; }
  /// The last row at or before a time in s; the first one when there is none.
  [[nodiscard]] long RowAt(double time) const;
};

/// @throws InputError "SOURCE: key: what is wrong" unless all series have a row for each time, qpos fits the
/// model and is finite, times increase, and the run lasts longer than an instant.
void CheckRunFrames(const mjModel& model, const RunFrames& run);

/// Puts a row of a run into `data` and computes what drawing needs.
void SetRow(const mjModel& model, const RunFrames& run, long row, mjData* data);

/// A row of contact_positions, contact_forces or contact_normals, at one contact.
Vector3d ContactVector(const RowMatrixXd& rows, long row, long contact);

/// How long the arrow of 1 N is drawn: the run's largest contact force fits beside a hand. 1 when there is
/// none.
double CalcMetersPerNewton(const RunFrames& run);

/// Worst residuals up to each row, so that a video can show at any time which check stands worst.
class CheckHistory {
 public:
  explicit CheckHistory(const RunFrames& run);

  /// Status of each category at `row`, in the order of kCheckCategories; none for a run without checks.
  [[nodiscard]] std::vector<CategoryStatus> ListCategories(long row) const;

 private:
  const RunFrames& run_;
  std::vector<std::vector<double>> worst_;  // by check, by row
};

/// A camera that stands still, as the engine's free camera: it looks along
/// f = (cos(elevation) cos(azimuth), cos(elevation) sin(azimuth), sin(elevation)), the world's z upwards.
struct Viewpoint {
  Vector3d look_at = Vector3d::Zero();  ///< World, m.
  double distance = 1.0;                ///< From the camera to look_at, m.
  double azimuth = 0.0;                 ///< rad.
  double elevation = 0.0;               ///< rad; negative looks down.
};

/// Sphere that must be in the picture.
struct VisibleSphere {
  Vector3d center;  ///< World, m.
  double radius;    ///< m.
};

/// Edges of a part of the picture: tangents of the angles between them and the camera's axis, positive.
struct ViewEdges {
  double left, right, bottom, top;
};

/// The nearest viewpoint with these angles from which all spheres lie between the edges; in the direction
/// that is not filled they are in the middle.
/// @throws std::invalid_argument when there is no sphere.
Viewpoint FitViewpoint(std::span<const VisibleSphere> spheres, double azimuth, double elevation,
                       const ViewEdges& edges);

/// Viewpoint that shows all that moves, from the run's beginning to its end, from the right and ahead.
/// @param data scratch for kinematics.
/// @throws std::invalid_argument when nothing in the model can move.
Viewpoint FindCourse(const mjModel& model, const RunFrames& run, const ViewEdges& edges, mjData* data);

/// How all that moves gets from the beginning to the end of a run.
struct Way {
  double length = 0.0;   ///< Along the floor, m.
  double bearing = 0.0;  ///< Of a view that sees it from the right and ahead, rad.
};

/// @param data scratch for kinematics.
Way FindWay(const mjModel& model, const RunFrames& run, mjData* data);

/// Viewpoint that shows all that moves at one instant.
/// @param bearing of the view, rad.
/// @param data whose kinematics are computed.
/// @throws std::invalid_argument when nothing in the model can move.
Viewpoint FindInstant(const mjModel& model, double bearing, const ViewEdges& edges, const mjData& data);

/// Viewpoint close to a body that shows it and its surroundings.
/// @param from in whose direction it stands, world, m.
Viewpoint FindCloseUp(const mjModel& model, int body, const Vector3d& from, const mjData& data);

}  // namespace dexcheck
