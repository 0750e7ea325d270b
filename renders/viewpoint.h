#pragma once

// Viewpoints from which all of something is in the picture.

#include <mujoco/mujoco.h>

#include <span>

#include "controller/common/types.h"
#include "renders/run_frames.h"

namespace dexcheck {

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
