#pragma once

// The control law (55), in two stages with the choice of F_N between them:
//
//   SetDemand     motion that is wanted -> F_o, torques without contact forces
//   (the caller)  F_o -> F_N, by the grasp-force problem
//   CalcTorque    F_N -> f_c (49), tau' (55)
//
// In terms of body velocities, V = P^-1 X_o_dot and V_dot = P^-1 X_o_ddot + d/dt(P^-1) X_o_dot, (55) reads
//   xi_c     = J^+ G^T V + N xi
//   xi_dot_d = J^+ (G_dot^T V + G^T V_dot - J_dot xi_c) + N sigma'
//   f_c      = G^+ (M_hat V_dot + C_hat V + N_o) + F_N
//   E_bar' tau' = M_bar' xi_dot_d + C_bar' xi_c + F_bar' + J_B'^T f_c
// and is computed with vectors: no n x n matrix is formed.

#include "controller/common/types.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/pseudoinverse.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/platform.h"
#include "controller/model/robot_model.h"

namespace dexcheck {

/// W of the pseudoinverse of J_B' in (47).
struct RedundancyWeight {
  enum class Kind { kIdentity, kDiagonal, kMass };
  Kind kind = Kind::kIdentity;
  VectorXd w;  ///< n, positive; kDiagonal only.
};

/// Factors J (k x n) with this W.
/// @param robot whose M_bar' is W for kMass. @throws as Pseudoinverse.
void FactorJacobian(const RedundancyWeight& weight, const ModelTerms& robot, const GraspTerms& grasp,
                    Pseudoinverse* J_B_pinv);

/// The law's workspace. Sized by the constructor; nothing else allocates.
class ComputedTorque {
 public:
  /// @throws std::invalid_argument when the weight does not fit the model, or there is no contact.
  ComputedTorque(const RobotModel& model, int num_contacts, RedundancyWeight weight = {});

  /// First stage. sigma of (47) is the measured xi: xi_c is the velocity nearest to it, in W, that satisfies
  /// (45).
  /// @param robot with CalcDynamics done, reduced. @param V_Bo_dot demanded of the object
  /// (CalcTrackingAcceleration). @param sigma_prime (n) null-space acceleration (PostureTask).
  /// @throws SingularityError, with the condition number, when J_B' or G has not full row rank;
  /// std::invalid_argument when sizes differ.
  void SetDemand(const ModelTerms& robot, const GraspTerms& grasp, const Vector6d& V_Bo_dot,
                 const Eigen::Ref<const VectorXd>& sigma_prime);
  /// The motion alone, (47) and tau_0, for contacts that need not hold the object: any number of them, F_o is
  /// not formed. @throws as SetDemand, without G.
  void SetMotion(const ModelTerms& robot, const GraspTerms& grasp, const Vector6d& V_Bo_dot,
                 const Eigen::Ref<const VectorXd>& sigma_prime);
  /// Sets the motion without any contact, (18): xi_dot_d is sigma'.
  void SetFreeMotion(const ModelTerms& robot, const Eigen::Ref<const VectorXd>& sigma_prime);

  /// In the place of the first stage, what another law demands: F_o (Sigma_o) and E_bar' tau_0 (n); xi_dot_d
  /// (n) is what the law means xi_dot to be. @throws as SetDemand.
  void SetForces(const GraspTerms& grasp, const Vector6d& F_o, const Eigen::Ref<const VectorXd>& force,
                 const Eigen::Ref<const VectorXd>& xi_dot_d);

  /// xi_c (n) and xi_dot_d (n), (47).
  [[nodiscard]] const VectorXd& xi_c() const { return xi_c_; }
  [[nodiscard]] const VectorXd& xi_dot_d() const { return xi_dot_d_; }
  /// F_o (Sigma_o) that the demand takes, (19).
  [[nodiscard]] const Vector6d& F_o() const { return F_o_; }
  /// tau_0 (n), N m: tau' without contact forces, all of it after SetFreeMotion. tau' = tau_0 + E_bar'^-1
  /// J_B'^T f_c.
  [[nodiscard]] const VectorXd& tau_0() const { return tau_0_; }

  /// F_N (k) = f_c - G^+ F_o of contact forces f_c (k) that give F_o.
  void CalcInternalForce(const Eigen::Ref<const VectorXd>& f_c, Eigen::Ref<VectorXd> F_N);

  /// Second stage.
  /// @param F_N (k) internal force, G F_N = 0, N.
  /// @return tau' (n), N m: [tau_r; tau_l] of the wheels, then joints.
  const VectorXd& CalcTorque(const GraspTerms& grasp, const Eigen::Ref<const VectorXd>& F_N);

  /// Second stage with contact forces f_c (k) that are given as a whole.
  const VectorXd& CalcTorqueWithForces(const GraspTerms& grasp, const Eigen::Ref<const VectorXd>& f_c);

  /// f_c (k) of (49) that belongs to the torques.
  [[nodiscard]] const VectorXd& f_c() const { return f_c_; }

 private:
  void CalcFreeTorque(const ModelTerms& robot);
  const VectorXd& AddContactTorque(const GraspTerms& grasp);

  RedundancyWeight weight_;
  ActuationMap actuation_;
  Pseudoinverse J_B_pinv_;
  Pseudoinverse G_pinv_;
  Vector6d F_o_ = Vector6d::Zero();
  VectorXd xi_c_, xi_dot_d_, tau_0_, tau_;  // n
  VectorXd f_c_;                            // k
  VectorXd work_;                           // n
  VectorXd rates_;                          // k
};

/// sigma' of (47), which the paper does not specify: a damped posture for the motions that do not move the
/// object,
///   sigma' = acceleration + damping (xi_reference - xi) + stiffness [0; q_posture - q],
/// entry by entry. The base has no posture; it follows because the arms pull toward theirs. Where the null
/// space takes all of sigma' (an arm that holds nothing), critical damping is damping^2 = 4 stiffness; with
/// the three references moving, (18) then follows them by computed torque.
struct PostureTask {
  /// No gains, posture 0, at rest.
  explicit PostureTask(const RobotModel& model);

  VectorXd q_posture;     ///< Joints alone, in their order, rad.
  VectorXd stiffness;     ///< Of the same joints, 1/s^2.
  VectorXd damping;       ///< Of all n entries of xi, 1/s.
  VectorXd xi_reference;  ///< n, m/s, rad/s.
  VectorXd acceleration;  ///< n, of a posture that moves, m/s^2, rad/s^2.

  /// Writes sigma' (n) at q' and xi. @throws std::invalid_argument when a size differs.
  void CalcAcceleration(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
                        Eigen::Ref<VectorXd> sigma_prime) const;
};

}  // namespace dexcheck
