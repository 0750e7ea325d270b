#pragma once

// Where a force acts that the model does not have, and how large it is: what the balances leave, explained by
// one joint, one body or gravity.

#include <string>
#include <vector>

#include "controller/control/actuation.h"
#include "controller/control/grasp_model.h"
#include "controller/dynamics/tree_factor.h"

namespace dexcheck {

/// What is known of a force after some steps. Fractions are of what the balances left, squared and in the
/// metric of the inertias, |f|_M^-1, over all steps that were added.
struct ForceFinding {
  std::string joint;  ///< Whose own force explains the robot's part best; empty when there is none.
  double joint_fraction = 0.0;
  double torque = 0.0;  ///< At that joint when it was largest, N m (of a sliding joint N).
  std::string link;     ///< A force at whose centre of mass explains it best.
  double link_fraction = 0.0;
  double link_force = 0.0;              ///< N, when it was largest.
  Vector3d gravity = Vector3d::Zero();  ///< World, m/s^2: by how much gravity would have to differ.
  double gravity_fraction = 0.0;        ///< Of robot and object together.
  double object_fraction = 0.0;         ///< Of the square that is the object's.
  double object_force = 0.0, object_moment = 0.0;  ///< On the object, N, N m, when the force was largest.
};

/// Sums over the steps whose balance failed. A finding is formed from
///
///   robot   M_bar' xi_dot + C_bar' xi + F_bar' + J_B'^T f_c - E_bar' tau' = f     (48)
///   object  M_hat V_o_dot + C_hat V_o + N_o - G f_c = w                           (19)
///
/// with the plant's accelerations and forces: f (n) and w (6, Sigma_o) are what acts besides. Candidates are
/// one joint's or wheel's torque, f = E_bar' e_i a(t); a force at one link's centre of mass, f = J_b^T F(t);
/// and another gravity, f = sum_b m_b J_b^T dg, w = [m R^T dg; 0], one dg for all steps.
class ForceEvidence {
 public:
  explicit ForceEvidence(const RobotModel& model);

  /// @param f, w as above. @param scale that the step's residuals are relative to, in |.|_M^-1.
  /// Allocates at the few steps that are looked at: the first ones, then ever fewer.
  void Add(const VectorXd& f, const Vector6d& w, const GraspModel& model, const VectorXd& q,
           const TreeFactor& mass_factor, double scale);
  [[nodiscard]] bool has_any() const { return squares_ > 0.0; }
  [[nodiscard]] ForceFinding Find() const;
  /// Whether gravity alone explains everything, and its direction is what differs: the floor is not level.
  [[nodiscard]] static bool IsSlope(const ForceFinding& finding, const Vector3d& gravity);
  /// In words: "joint r_elbow, 0.35 N m; explains 99 %".
  [[nodiscard]] std::string Tell() const;

 private:
  struct Candidate {
    std::string name;
    double square = 0.0;   ///< Explained.
    double largest = 0.0;  ///< N m or N.
  };
  /// Jacobian of each link's centre of mass, 3 x n each, base first.
  void CalcLinkJacobians(const VectorXd& q);
  void AddJoints(const RowMatrixXd& half_inverse, const VectorXd& y, double weight);
  void AddLinks(const RowMatrixXd& half_inverse, const VectorXd& y, double weight);

  const RobotModel* model_;
  ModelTerms kinematics_;
  ActuationMap actuation_;
  std::vector<Candidate> joints_, links_;
  std::vector<MatrixXd> link_jacobians_;
  long steps_ = 0;
  double squares_ = 0.0, robot_squares_ = 0.0;
  Matrix3d gravity_normal_ = Matrix3d::Zero();
  Vector3d gravity_product_ = Vector3d::Zero();
  double object_force_ = 0.0, object_moment_ = 0.0;
};

}  // namespace dexcheck
