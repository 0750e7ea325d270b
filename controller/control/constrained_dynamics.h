#pragma once

// Dynamics of robot and object as one constrained system (section 4.4), and of a robot that stands on the
// ground. n entries of xi, k of f_c, m feet.

#include <Eigen/Cholesky>

#include "controller/common/linear_algebra.h"
#include "controller/common/types.h"
#include "controller/contact/grasp_map.h"
#include "controller/control/grasp_terms.h"
#include "controller/dynamics/model_terms.h"
#include "controller/dynamics/tree_factor.h"

namespace dexcheck {

/// Motion and contact forces of the rigid constrained system.
struct Prediction {
  VectorXd xi_dot;                       ///< n, m/s^2, rad/s^2.
  Vector6d V_Bo_dot = Vector6d::Zero();  ///< Of the object's body velocity, Sigma_o.
  VectorXd f_c;                          ///< k, N, of finger on object, each in its Sigma_cf.
};

/// Support of the object's weight.
enum class ObjectSupport {
  kHand,    ///< The contacts alone.
  kAtRest,  ///< Something that it lies on, so firmly that it does not move.
};

/// Solves (19), (46) and (48) for accelerations and contact forces, as if bodies, contacts and wheels were
/// rigid and nothing slipped. Sized by the constructor; nothing else allocates.
class ConstrainedDynamics {
 public:
  /// @param num_contacts 0 for a robot that holds nothing, for which there is PredictFree alone.
  /// @throws std::invalid_argument when it is negative.
  ConstrainedDynamics(const RobotModel& model, int num_contacts);

  /// One solve of the saddle-point system
  ///   [ M_bar'   0      J_B'^T ] [ xi_dot   ]   [ force - C_bar' xi - F_bar'  ]
  ///   [ 0        M_hat  -G     ] [ V_Bo_dot ] = [ -C_hat V_Bo - N_o           ]
  ///   [ J_B'     -G^T   0      ] [ f_c      ]   [ -J_B_dot' xi + G_dot^T V_Bo ]
  /// by its Schur complement in f_c.
  /// @param robot with CalcDynamics done, reduced. @param force E_bar' tau' (n), N, N m.
  /// @param object kAtRest: it does not move, whatever the contacts do; its rows are left out.
  /// @param contact_acceleration (k), m/s^2: what the left of the third row less its right is to be, each in
  /// its Sigma_cf, for whoever stabilises the constraint; null for zero.
  /// @param push wrench on the object by others than contacts, Sigma_o, N, N m; null for none.
  /// @throws SingularityError when the contacts' constraints depend on each other; std::invalid_argument when
  /// sizes differ or there are no contacts.
  const Prediction& Predict(const ModelTerms& robot, const GraspTerms& grasp,
                            const Eigen::Ref<const VectorXd>& force,
                            ObjectSupport object = ObjectSupport::kHand,
                            const VectorXd* contact_acceleration = nullptr, const Vector6d* push = nullptr);

  /// The robot without contacts, (18): xi_dot; V_Bo_dot and f_c are zero.
  const Prediction& PredictFree(const ModelTerms& robot, const Eigen::Ref<const VectorXd>& force);

  /// C_bar' xi + F_bar' (n) of the last Predict.
  [[nodiscard]] const VectorXd& bias() const { return bias_; }
  /// M_bar' = L^T L of the last Predict.
  [[nodiscard]] const TreeFactor& mass_factor() const { return factor_; }

 private:
  /// First n entries of motion_: the forces without contact.
  void CalcFreeForce(const ModelTerms& robot, const Eigen::Ref<const VectorXd>& force);

  TreeFactor factor_;
  // Rows of J_B'^T whose joints carry a fingertip, followed by the object's six.
  std::vector<int> rows_;
  RowMatrixXd half_;  // n + 6 x k, padded: [M_bar'^-1/2 J_B'^T; -M_hat^-1/2 G]
  MatrixXd schur_;    // k x k, padded
  Eigen::LLT<MatrixXd> schur_llt_;
  VectorXd motion_;  // n + 6, M^-1/2 of the forces without contact, then without those of contacts
  VectorXd bias_;    // n
  Prediction prediction_;
};

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

  // Results of the last Predict.

  /// M_bar' = L^T L.
  [[nodiscard]] const TreeFactor& mass_factor() const { return factor_; }
  /// Whether the forces of all feet follow from the motion.
  [[nodiscard]] bool determines_forces() const { return constraints_.rank() == half_.cols(); }

 private:
  TreeFactor factor_;
  RowMatrixXd half_;  // n x 3m, L^-T J^T
  LeastSquares constraints_;
  Prediction prediction_;
};

}  // namespace dexcheck
