#pragma once

// What is read of a plant in one step: its true state before it is driven, and its response.

#include <vector>

#include "controller/common/types.h"
#include "controller/control/controller.h"
#include "controller/control/grasp_model.h"

namespace dexcheck {

/// Motion of the base that the paper's coordinates leave out.
struct BaseDeparture {
  double tilt = 0.0;    ///< Angle of the base's z axis against the vertical, rad.
  double height = 0.0;  ///< Of Sigma_0's origin against the model's, m.
};

/// The true state at the beginning of a step.
struct PlantReading {
  /// In the paper's coordinates: tilt and height of the base, which q' does not have, are dropped; kappa is
  /// where the plant's fingertips touch. Of a fingertip that is far from the object, kappa is the nearest
  /// place and the overlap -kFar.
  MeasuredState state;
  Touch touch;
  BaseDeparture departure;
  Pose X_W0 = Pose::Identity();  ///< Pose of Sigma_0 in the world, tilt and height included.
  VectorXd qpos;                 ///< MuJoCo's positions (nq), which draw the scene.
  VectorXd qvel;                 ///< MuJoCo's velocities (nv).
  /// Of MuJoCo's bodies: origin (3) and rotation, row by row (9), each; empty for a plant that has none.
  VectorXd body_positions, body_rotations;

  /// Gap between fingertip and object from which on they are just far apart, m.
  static constexpr double kFar = 5e-3;
};

/// One fingertip's contact as the plant has it.
struct PlantContact {
  bool touching = false;
  Vector3d position = Vector3d::Zero();  ///< World, m.
  Vector3d normal = Vector3d::Zero();    ///< World, from the fingertip into the object.
  double distance = 0.0;                 ///< m, negative when the bodies overlap.
  Vector3d force = Vector3d::Zero();     ///< World, N, of finger on object.
};

/// What two bodies push each other with that should not touch.
struct Collision {
  double force = 0.0;          ///< N
  int geom1 = -1, geom2 = -1;  ///< The engine's.
};

/// How the engine has two bodies touch; the deepest contact when there are several.
struct BodyContact {
  bool touching = false;
  double distance = 0.0;             ///< m, negative when the bodies overlap.
  Vector3d slip = Vector3d::Zero();  ///< Tangential velocity of `body` against the other, world, m/s.
  double cone_use = 0.0;             ///< |tangential force| / (mu normal force); 1 slides.
  double cone_margin = 0.0;          ///< mu normal force - |tangential force|, N.
};

/// Accelerations and forces of the same step, for the torques that were applied.
struct PlantResponse {
  VectorXd xi_dot;                       ///< n.
  Vector6d V_Bo_dot = Vector6d::Zero();  ///< Sigma_o.
  std::vector<PlantContact> contacts;    ///< By fingertip.
  std::vector<BodyContact> fingertips;   ///< How the fingertips slip on the object.
  std::vector<BodyContact> wheels;       ///< How the right and left wheel slip on the floor.
  Vector6d support_wrench =
      Vector6d::Zero();        ///< On the object by all else than fingertips, Sigma_o, N, N m.
  double support_force = 0.0;  ///< Its upward part, N.
  /// What the plant's solver left over of its own equation of motion of the object, as such a wrench.
  Vector6d solver_residual = Vector6d::Zero();
  Collision collision;     ///< The largest; of a plant whose bodies push, see Clearance.
  VectorXd motor_torques;  ///< n, N m: what wheels and joints received from their motors, as tau'.
  /// n, N and N m, as forces on xi, empty where there are none: dry friction of the joints, and their limits.
  VectorXd dry_friction, stop_force;
  /// n, N and N m: T^T M (qacc - T xi_dot - T_dot xi), the inertia of what xi_dot leaves out, a platform that
  /// tilts or sinks and wheels that slip, on soft contacts. Empty for a plant that has nothing of the kind.
  VectorXd departure_force;
  /// n, N and N m: what the plant's solver left over of its own equation of motion of the robot; empty
  /// likewise.
  VectorXd solver_force;
};

}  // namespace dexcheck
