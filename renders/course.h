#pragma once

#include <mujoco/mujoco.h>

#include "renders/run_frames.h"
#include "renders/viewpoint.h"

namespace dexcheck {

/// Where a camera stands that sees all that moves, from the run's beginning to its end, from the right and
/// ahead.
/// @param data scratch for kinematics.
/// @throws std::invalid_argument when nothing in the model can move.
Viewpoint FindCourse(const mjModel& model, const RunFrames& run, const ViewEdges& edges, mjData* data);

}  // namespace dexcheck
