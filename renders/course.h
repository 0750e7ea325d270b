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

/// How all that moves gets from the beginning to the end of a run.
struct Way {
  double length = 0.0;   ///< Along the floor, m.
  double bearing = 0.0;  ///< Of a view that sees it from the right and ahead, rad.
};

/// @param data scratch for kinematics.
Way FindWay(const mjModel& model, const RunFrames& run, mjData* data);

/// Where a camera stands that sees all that moves at one instant.
/// @param bearing of the view, rad.
/// @param data whose kinematics are computed.
/// @throws std::invalid_argument when nothing in the model can move.
Viewpoint FindInstant(const mjModel& model, double bearing, const ViewEdges& edges, const mjData& data);

/// Where a camera stands that sees a body and what is beside it from near by.
/// @param from in whose direction it stands, world, m.
Viewpoint FindCloseUp(const mjModel& model, int body, const Vector3d& from, const mjData& data);

}  // namespace dexcheck
