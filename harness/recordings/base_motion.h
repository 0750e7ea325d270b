#pragma once

// Forces that act on a robot for a while, and motions of a base that a recording takes to be at rest.

#include <vector>

#include "harness/recordings/torque_rows.h"

namespace dexcheck {

/// The angular frequency (rad/s) at which an acceleration of the base explains most of the residual, over
/// blocks of time; 0 where none explains a fifth of it, or a base's pose was recorded.
double FindShaking(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left);

/// The few stretches of a recording in which the residual stands out, and the one to its end in which a
/// constant acceleration of the base, or a tilt, explains most of it and a fifth of all.
std::vector<Push> FindPushes(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left,
                             size_t recording);

/// Pushes during one stretch of time.
std::vector<TorqueFault> ListPushes(const RobotModel& model, const std::vector<int>& joints, const Push& when,
                                    const MotionExtents& extents);

/// When a push begins and ends, near to when it is thought to: what it explains is most.
/// @param left without it.
Push FindTimes(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left, Push push);

}  // namespace dexcheck
