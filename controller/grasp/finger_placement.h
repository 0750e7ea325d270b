#pragma once

// Inverse kinematics of a grasp: finger joints that bring the fingertips to given points of an object.

#include <span>

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

// Inverse kinematics of an arm: joints that bring a frame of the robot to a pose.

struct FramePlacementOptions {
  double tolerance = 1e-13;   ///< Largest distance, m, and largest angle, rad, from the pose.
  int max_iterations = 100;   ///< From each start.
  int num_starts = 64;        ///< q itself, q_nominal, then postures spread over the ranges; at least 1.
  double joint_margin = 0.0;  ///< Distance that the joints keep from the ends of their ranges, rad or m.
  double length = 0.2;        ///< While searching, an error of one radian counts as this many m.
};

struct FramePlacement {
  VectorXd q;                      ///< q' with `joints` solved, the others as given.
  double position_residual = 0.0;  ///< Distance of the frame's origin from its place, m.
  double joint_margin = 0.0;       ///< Smallest distance of one of the joints from the ends of its range.
  bool reached = false;            ///< Within the tolerance and the joint margin.
};

/// Moves some joints until a frame of the model is at a pose, six equations. With more joints than needed the
/// posture is pulled towards q_nominal. Of the starts the first that arrives counts, so that the posture
/// nearest to `q` is preferred; when none does, the nearest miss is returned. Deterministic.
/// @param frame of the model. @param X_BF where it should be, in the world. @param joints on the chain from
/// the base to the frame. @param q q' to start from. @param q_nominal q' to stay near to.
/// @throws std::invalid_argument when a joint does not move the frame, a size differs, X_BF is no pose, or
/// the margin leaves a joint no range.
FramePlacement SolveFramePlacement(const RobotModel& model, int frame, const Pose& X_BF,
                                   std::span<const int> joints, const Eigen::Ref<const VectorXd>& q,
                                   const Eigen::Ref<const VectorXd>& q_nominal,
                                   const FramePlacementOptions& options = {});

}  // namespace dexcheck
