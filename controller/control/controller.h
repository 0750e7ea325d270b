#pragma once

// A controller stands between sensors and motors: a control law, or a task that uses several.

#include "controller/common/types.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/joint_motion.h"
#include "controller/control/reading.h"
#include "controller/control/trajectory.h"

namespace dexcheck {

/// Contacts that a step commands.
struct Handling {
  bool partial = false;     ///< Contacts come and go, and the object may lie on something: a task.
  bool holding = true;      ///< All fingertips should touch the object.
  ContactSet contacts = 0;  ///< Of a task: fingertips that the law lets push.
};

/// Motion and forces of the rigid constrained system (46), (48) under the torques of a control law.
struct LawDemand {
  Vector6d V_Bo_dot = Vector6d::Zero();  ///< Of the object's body velocity, Sigma_o, m/s^2, rad/s^2.
  VectorXd xi_dot;                       ///< xi_dot_d (n) of (47).
  /// 3N, N, of finger on object, each in its Sigma_cf; (49). Of a robot that stands, of the ground on its
  /// feet, world axes.
  VectorXd f_c;
  VectorXd F_N;  ///< 3N, internal part of f_c; zero unless (49) splits it so.
};

/// Progress of a task.
struct TaskProgress {
  int phase = -1;       ///< Number of the phase, in the task's own order; -1 without a task.
  double weight = 0.0;  ///< Part of the object's stated weight that the hand bears.
};

/// Torques that a controller sends at one instant, and the motion that they are to cause.
struct Command {
  VectorXd tau;           ///< tau' (n), N m: of the right and left wheel, then of the joints.
  DesiredMotion desired;  ///< Of the object; where it is, when it need not move.
  bool tracks = true;     ///< Whether the object should follow `desired`.
  /// Desired joints of a robot that holds nothing and follows a joint motion; empty otherwise.
  DesiredJoints joints;
  bool computes_joints = false;  ///< Whether `tau` was computed for them at this instant.
  LawDemand demand;
  Handling handling;
  TaskProgress task;
  double force_seconds = 0.0;  ///< Time that the grasp-force problem took, s.
  int force_solves = 0;        ///< Grasp-force problems solved.
};

/// One controller. The loop calls Follow, then Step at each time step while everything comes to rest, then
/// Begin, and then Step again with the time since the run began.
class Controller {
 public:
  virtual ~Controller() = default;

  /// The object is to follow this motion, which outlives its use, from the next Step on; a new torque is due
  /// there. A controller with a task of its own keeps still instead until Begin.
  virtual void Follow(const Trajectory& motion) = 0;

  /// The run begins at time t, s. @param reading of the last step before.
  /// @throws InputError when what is requested cannot be done.
  virtual void Begin(double t, const Reading& reading) = 0;

  /// Decides what to do at time t, s. Nothing allocates, except where a task says so.
  /// @param command filled in the order in which it is known: what has been decided when something is thrown
  /// can be read. The caller passes the same one at every step.
  /// @throws Error when there is nothing to send.
  virtual void Step(const Reading& reading, double t, Command* command) = 0;

  /// Whether the controller has nothing left to do.
  [[nodiscard]] virtual bool is_done() const { return false; }

  /// The model as the controller evaluated it at its last Step, for whoever checks it; at a fixed address.
  [[nodiscard]] virtual const GraspModel& model() const = 0;

 protected:
  Controller() = default;
  Controller(const Controller&) = default;
  Controller& operator=(const Controller&) = default;
};

}  // namespace dexcheck
