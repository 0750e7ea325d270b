#pragma once

// Dynamics of a robot that stands on the ground, as one constrained system. n entries of xi, m feet.

#include "controller/common/linear_algebra.h"
#include "controller/contact/ground_contacts.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/dynamics/tree_factor.h"

namespace dexcheck {

/// Solves
///   [ M_bar'  -J^T ] [ xi_dot ]   [ force - C_bar' xi - F_bar' ]
///   [ J        0   ] [ f      ] = [ -J_dot xi                  ]
/// as if feet and ground were rigid and nothing slipped. Where more feet touch than hold the robot, xi_dot
/// and J^T f are determined, and of all f that fit the smallest is given.
class GroundDynamics {
 public:
  GroundDynamics(const RobotModel& model, int feet);

  /// @param robot CalcDynamics done, reduced. @param ground at the same state. @param force E_bar' tau' (n).
  /// @return xi_dot, and as f_c the ground's forces on the feet (3m), world axes, N.
  const Prediction& Predict(const ModelTerms& robot, const GroundContacts& ground,
                            const Eigen::Ref<const VectorXd>& force);

  // Of the last Predict.

  /// M_bar' = L^T L.
  [[nodiscard]] const TreeFactor& mass_factor() const { return factor_; }
  /// Whether the forces of all feet follow from the motion.
  [[nodiscard]] bool determines_forces() const { return constraints_.rank() == half_.cols(); }
  /// |f| at most this times |a|_M of the acceleration that it makes, sqrt(kg); where forces are determined.
  [[nodiscard]] double CalcForceGain() const;

 private:
  TreeFactor factor_;
  RowMatrixXd half_;  // n x 3m, L^-T J^T
  LeastSquares constraints_;
  Prediction prediction_;
};

}  // namespace dexcheck
