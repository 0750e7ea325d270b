#pragma once

// Inertia of robot and object as the object feels it (Khatib 1987, 1988):
//
//   Lambda_c = (J_B' M_bar'^-1 J_B'^T)^-1    of the robot at its contact points, k x k, kg
//   Lambda   = M_hat + G Lambda_c G^T        of robot and object in Sigma_o, 6 x 6: the augmented object

#include <Eigen/Cholesky>

#include "controller/common/types.h"
#include "controller/control/grasp_terms.h"
#include "controller/dynamics/model_terms.h"
#include "controller/dynamics/tree_factor.h"

namespace dexcheck {

/// Workspace for both at one state. Sized by the constructor; nothing else allocates.
class ObjectSpaceInertia {
 public:
  /// @throws std::invalid_argument unless num_contacts > 0.
  ObjectSpaceInertia(const RobotModel& model, int num_contacts);

  /// @param robot with CalcDynamics done, reduced.
  /// @throws SingularityError when J_B' has not full row rank; std::invalid_argument when sizes differ.
  void Compute(const ModelTerms& robot, const GraspTerms& grasp);

  /// Lambda, Sigma_o: kg, kg m, kg m^2.
  [[nodiscard]] const Matrix6d& Lambda() const { return Lambda_; }
  /// Lambda^-1 W: the acceleration that a wrench W on the augmented object gives it, both in Sigma_o.
  [[nodiscard]] Vector6d CalcAcceleration(const Vector6d& W) const { return Lambda_llt_.solve(W); }
  /// y (k) becomes Lambda_c y: accelerations of the contact points to forces, each in its Sigma_cf.
  void MultiplyContactInertia(Eigen::Ref<VectorXd> y) const { inverse_llt_.solveInPlace(y); }
  /// M_bar' = L^T L.
  [[nodiscard]] const TreeFactor& mass_factor() const { return factor_; }

 private:
  TreeFactor factor_;
  RowMatrixXd half_;  // n x k, padded: M_bar'^-1/2 J_B'^T
  MatrixXd inverse_;  // k x k, padded: Lambda_c^-1
  Eigen::LLT<MatrixXd> inverse_llt_;
  MatrixXd G_T_;  // k x 6, L_c^-1 G^T with Lambda_c^-1 = L_c L_c^T
  Matrix6d Lambda_ = Matrix6d::Identity();
  Eigen::LLT<Matrix6d> Lambda_llt_;
};

}  // namespace dexcheck
