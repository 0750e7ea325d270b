#pragma once

// The printed law (53)-(55), computed a second time: with dense matrices, straight from the formulas, and
// from terms that another side evaluated. It shares the formulas of no law with controller/control, so that a
// fault there is seen; with rotation feedback, e_R and the desired pose are the controller's functions.
//
//   X_o_ddot = X_d_ddot + K_v (X_d_dot - X_o_dot) + K_p (X_d - X_o)                 the last bracket of (55)
//   V_o_dot  = P^-1 X_o_ddot + d/dt(P^-1) X_o_dot
//   xi_c     = xi - J^+ (J xi - G^T V_o)                                            (47) with sigma = xi
//   xi_dot_d = J^+ (G_dot^T V_o + G^T V_o_dot - J_dot xi_c) + N sigma'              (47)
//   f_c      = G^+ (M_hat V_o_dot + C_hat V_o + N_o) + F_N                          (49)
//   E_bar' tau' = M_bar' xi_dot_d + C_bar' xi_c + F_bar' + J^T f_c                  (55)

#include <Eigen/Cholesky>
#include <array>
#include <span>

#include "controller/common/types.h"
#include "controller/control/computed_torque.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/trajectory.h"
#include "controller/control/trajectory_controller.h"

namespace dexcheck {

/// Body angular velocity by the rates of ZYZ angles: omega = B [alpha_dot; beta_dot; gamma_dot], R = R_z R_y
/// R_z.
Matrix3d CalcAngleMap(const Vector3d& angles);
/// Its rate.
Matrix3d CalcAngleMapRate(const Vector3d& angles, const Vector3d& rates);

/// Robot, object and contacts at one state, by either side. n entries of xi, k = 3N of f_c; contact forces
/// and J in each Sigma_cf, the object in Sigma_o.
struct LawTerms {
  VectorXd q, xi;               ///< q' (p'), xi (n).
  const MatrixXd* M = nullptr;  ///< M_bar' (n x n).
  VectorXd C_xi;                ///< C_bar' xi (n).
  VectorXd gravity, friction;   ///< n; F_bar' is their sum.
  MatrixXd J;                   ///< J_B' (k x n).
  VectorXd J_dot_xi;            ///< k.
  Matrix6Xd G;                  ///< 6 x k.
  VectorXd G_dot_T_V;           ///< G_dot^T V_Bo (k).
  Pose X_Bo = Pose::Identity();
  Vector6d V_Bo = Vector6d::Zero();
  Vector6d X_o = Vector6d::Zero();  ///< Coordinates of X_Bo, on the law's branch of the angles; kAngles only.
  Matrix6d M_hat = Matrix6d::Zero();
  Vector6d C_hat_V = Vector6d::Zero();
  Vector6d N_o = Vector6d::Zero();
  /// C_bar' (n x n) and J_B_dot' (k x n) multiply only xi - xi_c here, which is zero where nothing slips.
  const MatrixXd* C = nullptr;
  const MatrixXd* J_dot = nullptr;

  /// Sizes all members.
  LawTerms(int num_positions, int num_velocities, int num_forces);
};

/// The object's part of LawTerms.
struct LawObject {
  Pose X_Bo = Pose::Identity();
  Vector6d V_Bo = Vector6d::Zero();
  Vector6d X_o = Vector6d::Zero();  ///< kAngles only.
};

/// Specification of the correct law, with the changes that make a wrong one.
struct LawSpec {
  ObjectGains gains;
  OrientationFeedback orientation = OrientationFeedback::kAngles;
  RedundancyWeight weight;
  PostureTask posture;
  // Changes that a wrong law may have: factors of each K_p and K_v, and of d/dt(P^-1) X_o_dot, whether sigma'
  // is projected into the null space, and G^T instead of G^+.
  Vector6d position_factor = Vector6d::Ones(), velocity_factor = Vector6d::Ones();
  double rate_factor = 1.0;
  bool projects = true, transposes_grasp = false;
};

/// Returns the specification of the scenario's law.
LawSpec MakeLawSpec(const GraspControllerOptions& options);

/// The law at one state. Nothing allocates after construction.
class LawReference {
 public:
  LawReference(int num_velocities, int num_forces);

  /// @param F_N (k) internal force chosen by the law's optimisation. @param desired X_d and its rates.
  /// @returns false when J or G has not full row rank.
  bool Evaluate(const LawSpec& spec, const LawTerms& terms, const DesiredMotion& desired,
                const Eigen::Ref<const VectorXd>& F_N);

  /// V_o_dot that (55) demands of an object in this state, wherever the robot is.
  Vector6d CalcDemand(const LawSpec& spec, const LawObject& object, const DesiredMotion& desired);

  /// E_bar' tau' (n).
  [[nodiscard]] const VectorXd& force() const { return force_; }
  [[nodiscard]] const Vector6d& V_Bo_dot() const { return V_Bo_dot_; }
  [[nodiscard]] const VectorXd& xi_dot_d() const { return xi_dot_d_; }
  [[nodiscard]] const VectorXd& f_c() const { return f_c_; }
  [[nodiscard]] const VectorXd& sigma_prime() const { return sigma_prime_; }
  /// Bound on the condition number of J W^-1/2: sqrt(trace(A) trace(A^-1)) of A = J W^-1 J^T.
  [[nodiscard]] double condition_number() const { return condition_number_; }
  /// Force C_bar' (xi_c - xi) and acceleration J^+ J_dot (xi_c - xi) (n), by which (46), (48) differ from
  /// (47), (55) where contacts slip.
  [[nodiscard]] const VectorXd& slip_coriolis() const { return slip_coriolis_; }
  [[nodiscard]] const VectorXd& slip_acceleration() const { return slip_acceleration_; }
  /// J_dot (xi_c - xi) (k).
  [[nodiscard]] const VectorXd& slip_rates() const { return slip_rates_; }
  /// x (n) = J^+ y of (47); y (k) is lost.
  void ApplyPseudoinverse(VectorXd* y, VectorXd* x) const;
  /// Adds G^+ F_o (k) to contact forces.
  void AddLeastForces(const Vector6d& F_o, VectorXd* f_c) const;
  /// (G G^T)^-1 G f (k -> 6): the wrench-free part of f is f - G^T of this.
  [[nodiscard]] Vector6d SolveGrasp(const Eigen::Ref<const VectorXd>& f) const;

 private:
  /// Summands of V_o_dot.
  using Demand = std::array<Vector6d, 4>;
  [[nodiscard]] bool FactorJacobian(const LawSpec& spec, const LawTerms& terms);
  static Demand CalcObjectAcceleration(const LawSpec& spec, const LawObject& object,
                                       const DesiredMotion& desired);

  MatrixXd W_inv_J_T_;  // n x k
  MatrixXd A_, L_inv_;  // k x k: A = J W^-1 J^T = L L^T
  Eigen::LLT<MatrixXd> llt_, W_llt_;
  Eigen::LLT<Matrix6d> G_llt_;
  Matrix6Xd G_;
  Vector6d V_Bo_dot_ = Vector6d::Zero();
  VectorXd rates_, slip_rates_, f_c_;                        // k
  VectorXd slip_coriolis_, slip_acceleration_;               // n
  VectorXd xi_c_, xi_dot_d_, motion_, sigma_prime_, force_;  // n
  double condition_number_ = 0.0;
};

}  // namespace dexcheck
