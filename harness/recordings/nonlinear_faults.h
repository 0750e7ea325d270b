#pragma once

// Faults whose effect on torques is not linear: signs, gains, offsets and orders of positions and torques,
// the clock, and where the model has a joint. Each is tried by undoing it.

#include <vector>

#include "harness/diagnosis/causes.h"
#include "harness/recordings/channels.h"
#include "harness/recordings/motion_fit.h"

namespace dexcheck {

/// A fault of a recording, or of the model's geometry, and how to undo it.
struct NonlinearFault {
  /// The numbers that are estimated beside the kind of fault.
  enum class Number { kNone, kGain, kOffset, kClock, kPlacement, kOrientation, kAxis };

  Fault fault;
  Number number = Number::kNone;
  int joint = -1;                     ///< -1 for all.
  double factor = 1.0, offset = 0.0;  ///< That undo it: factor times what is recorded, plus the offset.
  double clock = 1.0;                 ///< Factor of the times that undoes it.
  std::vector<int> order = {};        ///< The joint that each joint's columns are of; empty for its own.
  bool is_motion = true;              ///< Positions, velocities and accelerations.
  bool is_torque = false;             ///< Torques or currents.
  bool has_right_rates = false;       ///< Velocities are none of what is undone.
  bool shows_all = true;              ///< The motion determines every one of the numbers.
  /// Translation of the joint that undoes it, in its parent's frame, m.
  Vector3d shift = Vector3d::Zero();
  /// Rotation vector of the joint about its own origin that undoes it, in its parent's axes, rad. Of kAxis
  /// what the joint carries stays where it is at zero.
  Vector3d turn = Vector3d::Zero();

  [[nodiscard]] bool IsOfModel() const { return number >= Number::kPlacement; }
  /// Returns how many numbers are estimated.
  [[nodiscard]] Eigen::Index CountNumbers() const;
  void Undo(Recording* recording) const;
  void Undo(RecordedSample* sample) const;
  void Undo(RobotSpec* robot) const;
};

/// Directions in its parent's frame: two orthogonal to a joint's axis, and the axis (3 x 3).
MatrixXd FindDirections(const RobotModel& model, int joint);

/// Returns those that nothing in the recording speaks against: its units, its columns, and the joints'
/// ranges.
/// @param ranges lowest and highest recorded positions (n x 2), rad or m.
std::vector<NonlinearFault> ListNonlinearFaults(const RobotModel& model, const Recording& recording,
                                                const MatrixXd& ranges);

}  // namespace dexcheck
