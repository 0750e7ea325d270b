#pragma once

// A robot that stands on its feet: what the ground has to give, and the motion of its joints while its body
// moves.

#include <vector>

#include "controller/contact/grasp_map.h"
#include "controller/control/joint_motion.h"
#include "controller/grasp/grasp_force.h"

namespace dexcheck {

/// The feet, and what the law may ask of the ground.
struct Stance {
  std::vector<int> feet;  ///< Frames, three at least.
  double height = 0.0;    ///< Of the ground, m.
  double mu = 0.5;        ///< Friction that the law counts on.
  double f_min = 0.0;     ///< Least normal force of a foot, N.
  double f_max = 0.0;     ///< Largest, N.
};

/// Chooses the ground's forces that a robot's own motors cannot do without. With the force F (n) that a law
/// wants on all coordinates, those of the base included, f (3m) is inside its cones and
///
///   J_b^T f = F_b,   tau = (F - J^T f)_joints:
///
/// of all such f the one that GraspForceSolver chooses, of the base's six rows in the place of the grasp map.
/// The constrained system then does M (xi_dot - xi_dot*) = J^T (f_true - f) of F = M xi_dot* + ...: by
/// Gauss's principle what the feet allow that is nearest to xi_dot*. Allocates nothing after construction.
class StanceForces {
 public:
  /// @throws std::invalid_argument unless the base floats, and as GraspForceSolver.
  StanceForces(const RobotModel& model, const Stance& stance);

  /// Takes J^T f off a force on xi (n), whose first six entries are zero then, but for rounding.
  /// @param robot SetState done, reduced. @throws GraspForceError when no f is inside its cones.
  void TakeOff(const ModelTerms& robot, Eigen::Ref<VectorXd> force);
  /// f (3m) of the last call, of the ground on the feet, world axes, N.
  [[nodiscard]] const VectorXd& f() const { return f_; }

 private:
  GroundContacts ground_;
  GraspForceProblem problem_;
  GraspForceSolver solver_;
  VectorXd f_;
};

/// Motion of all joints while the body follows a trajectory and the feet stay: q_d, xi_d, xi_dot_d of a
/// floating base and its joints.
class StanceMotion {
 public:
  /// @param q_start q', with all feet on the ground. @param body displacement of the base from there: x, y, z
  /// (m, world), roll, pitch, yaw (rad, about axes of the world's directions).
  StanceMotion(const RobotModel& model, const Stance& stance, const VectorXd& q_start, JointMotion body);

  /// Feet roll on the ground as spheres do: exactly about one axis, to second order in their turn about
  /// several, where the way that they have rolled depends on the order. Joints that move no foot stay.
  /// Allocates.
  void Evaluate(double t, DesiredJoints* desired) const;

 private:
  const RobotModel* model_;
  Stance stance_;
  VectorXd q_start_;
  JointMotion body_;
  std::vector<Pose> X_WF_start_;
};

/// Moves the joints until all feet are at the ground's height, with the base where it is. @return the largest
/// gap that is left, m.
double PutFeetDown(const RobotModel& model, const Stance& stance, VectorXd* q);

/// q_d - q as a displacement (n): of a floating base in the coordinates of its velocity.
void CalcPositionError(bool floats, const Eigen::Ref<const VectorXd>& q_d,
                       const Eigen::Ref<const VectorXd>& q, Eigen::Ref<VectorXd> error);

}  // namespace dexcheck
