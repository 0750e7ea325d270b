#pragma once

#include <mujoco/mujoco.h>

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

}  // namespace dexcheck
