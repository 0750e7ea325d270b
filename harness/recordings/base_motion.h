#pragma once

// A base that moves in a recording that takes it to be at rest: how it may move.

#include <optional>

#include "harness/recordings/torque_rows.h"

namespace dexcheck {

/// The angular frequency (rad/s) at which an acceleration of the base explains most of what is left, over
/// blocks of time; 0 where none explains a fifth of it, or a base's pose was recorded.
double FindShaking(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left);

/// The time (s) since which a constant acceleration of the base, or a tilt, explains most of what a recording
/// leaves, and a fifth of it.
std::optional<double> FindStep(const RecordingSet& recordings, const TorqueRows& rows, const VectorXd& left,
                               size_t recording);

}  // namespace dexcheck
