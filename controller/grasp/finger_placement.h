#pragma once

// Inverse kinematics of a grasp: finger joints that bring the fingertips to given points of an object.

#include <span>
#include <vector>

#include "controller/common/types.h"
#include "controller/contact/surface.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

struct FingerPlacementOptions {
  double tolerance = 1e-14;  ///< Largest distance of a fingertip's centre from its place, m.
  int max_iterations = 100;
  double penetration = 0.0;  ///< How deep the fingertips' spheres overlap the object, m.
};

struct FingerPlacement {
  VectorXd q;             ///< q' with the fingers' joints solved, the others as given.
  double residual = 0.0;  ///< Largest distance of a fingertip's centre from its place, m.
  bool reached = false;   ///< Within the tolerance and the joint ranges.
};

/// Moves each finger's own joints until its fingertip touches the object at its target. A finger's own joints
/// are those that no other of the fingertips hangs on; there may be more of them than needed, then the least
/// change is taken.
/// @param fingertips frames of the model that carry spheres. @param targets one point of the surface for
/// each.
/// @param X_Bo pose of the object in the world. @param q q' to start from.
/// @throws std::invalid_argument when sizes differ, a frame is no fingertip or a finger has no joints of its
/// own.
FingerPlacement SolveFingerPlacement(const RobotModel& model, std::span<const int> fingertips,
                                     const Surface& object, const Pose& X_Bo,
                                     std::span<const SurfacePoint> targets,
                                     const Eigen::Ref<const VectorXd>& q,
                                     const FingerPlacementOptions& options = {});

}  // namespace dexcheck
