#pragma once

// Laws to compare the paper's with: what they demand of robot and object before the grasp force is chosen.
// All of them hand over F_o and E_bar' tau_0, so that the second stage (CalcTorque: F_N from the friction
// cones, f_c = G^+ F_o + F_N, E_bar' tau' = E_bar' tau_0 + J_B'^T f_c) and the null-space acceleration sigma'
// are those of (55).
//
// Errors are twists in Sigma_o (ObjectErrors): e, and V_e = V_d - V_Bo. Lambda is the augmented object's
// inertia (ObjectSpaceInertia), W = K e + D V_e the wrench of stiffness and damping. J is J_B', g and d are
// gravity's and friction's part of F_bar'.
//
// kPdGravity [Takegaki, Arimoto 1981]: stiffness and damping against a constant weight, nothing that moves is
// known.
//   V_dot        = Lambda^-1 W
//   E_bar' tau_0 = M_bar' (J^+ G^T V_dot + N sigma') + g            F_o = M_hat V_dot + N_o
//
// kFeedforwardPd [Paden, Panja 1988, "PD+"]: the same wrench, and what the desired motion takes. X_d does not
// determine q', so the terms are those of the measured posture.
//   V_dot        = V_d_dot + Lambda^-1 W
//   xi_d         = xi - J^+ (J xi - G^T V_d)
//   xi_dot_d     = J^+ (G_dot^T V_d + G^T V_dot - J_dot xi_d) + N sigma'
//   E_bar' tau_0 = M_bar' xi_dot_d + C_bar' xi_d + F_bar'           F_o = M_hat V_dot + C_hat V_d + N_o
//
// kImpedance [Hogan 1985; Albu-Schaeffer, Ott, Frese, Hirzinger 2003; Wimboeck, Ott, Hirzinger 2006]: as
// kFeedforwardPd, with a damping that follows the posture. Contact with the surroundings is not measured, so
// the inertia is left as it is: Lambda (V_d_dot - V_dot) + D V_e + K e = F_ext, up to Coriolis forces of V_e.
//   Lambda = Q Q^T,  K = Q diag(k) Q^T,  D = 2 zeta Q diag(sqrt k) Q^T
//
// kOperationalSpace [Khatib 1987]: V_dot as (55). With the dynamically consistent inverse in the place of
// J^+; by algebra this is (55) with W = M_bar' where nothing slips.
//   F_c          = Lambda_c (G^T V_dot + G_dot^T V - J_dot xi - J sigma')
//   E_bar' tau_0 = J^T F_c + M_bar' sigma' + C_bar' xi + F_bar'     F_o = M_hat V_dot + C_hat V + N_o
//
// M. Takegaki, S. Arimoto, A new feedback method for dynamic control of manipulators, ASME J. Dynamic
// Systems, Measurement, and Control 103, 1981. B. Paden, R. Panja, Globally asymptotically stable "PD+"
// controller for robot manipulators, Int. J. Control 47, 1988. O. Khatib, A unified approach for motion and
// force control of robot manipulators: the operational space formulation, IEEE J. Robotics and Automation 3,
// 1987. N. Hogan, Impedance control: an approach to manipulation, ASME J. Dynamic Systems, Measurement, and
// Control 107, 1985. A. Albu-Schaeffer, C. Ott, U. Frese, G. Hirzinger, Cartesian impedance control of
// redundant robots, ICRA 2003. T. Wimboeck, C. Ott, G. Hirzinger, Passivity-based object-level impedance
// control for a multifingered hand, IROS 2006.

#include <Eigen/Cholesky>
#include <string_view>

#include "controller/common/types.h"
#include "controller/control/computed_torque.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/pseudoinverse.h"
#include "controller/dynamics/model_terms.h"
#include "controller/dynamics/tree_factor.h"

namespace dexcheck {

// Inertia of robot and object as the object feels it (Khatib 1987, 1988):
//
//   Lambda_c = (J_B' M_bar'^-1 J_B'^T)^-1    of the robot at its contact points, k x k, kg
//   Lambda   = M_hat + G Lambda_c G^T        of robot and object in Sigma_o, 6 x 6: the augmented object

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
  [[nodiscard]] Vector6d CalcAcceleration(const Vector6d& W) const;
  /// y (k) becomes Lambda_c y: accelerations of the contact points to forces, each in its Sigma_cf.
  void MultiplyContactInertia(Eigen::Ref<VectorXd> y) const;
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

/// Which law makes the torques.
enum class ControlLaw { kComputedTorque, kPdGravity, kFeedforwardPd, kOperationalSpace, kImpedance };

/// "computed_torque", "pd_gravity", "feedforward_pd", "operational_space", "impedance".
std::string_view NameOf(ControlLaw law);

/// Whether the law's gains are a stiffness in N/m and N m/rad, or those of (57) in 1/s^2.
constexpr bool HasStiffness(ControlLaw law) {
  return law == ControlLaw::kPdGravity || law == ControlLaw::kFeedforwardPd || law == ControlLaw::kImpedance;
}

/// K and D of W = K e + D V_e: diagonals along the world's axes for the position, about Sigma_o's for the
/// orientation.
struct ObjectStiffness {
  Vector6d K = Vector6d::Zero();  ///< N/m, N m/rad.
  Vector6d D = Vector6d::Zero();  ///< N s/m, N m s/rad; not of kImpedance.
  double damping_ratio = 1.0;     ///< zeta; of kImpedance alone.
};

/// The least constant K and D that give each axis by itself the error dynamics (57) at a state: K_p and K_v
/// times the diagonal of Lambda, in the axes of ObjectStiffness. The damping ratio is the mean of K_v / (2
/// sqrt K_p) over the axes with K_p > 0, 0 without any.
ObjectStiffness CalcStiffness(const ObjectGains& gains, const Matrix6d& Lambda, const Matrix3d& R_Bo);

/// One law's workspace. Sized by the constructor; nothing else allocates.
class BaselineLaw {
 public:
  struct Options {
    ObjectGains gains;  ///< kOperationalSpace.
    OrientationFeedback orientation = OrientationFeedback::kAngles;
    RedundancyWeight weight;    ///< Of J^+; not of kOperationalSpace.
    ObjectStiffness stiffness;  ///< The others.
  };

  /// @throws std::invalid_argument for kComputedTorque, or when the weight does not fit the model.
  BaselineLaw(const RobotModel& model, int num_contacts, ControlLaw law, const Options& options);

  /// @param robot with CalcDynamics done, reduced. @param sigma_prime (n) null-space acceleration.
  /// @throws as ComputedTorque::SetDemand.
  void SetDemand(const ModelTerms& robot, const GraspTerms& grasp, const DesiredMotion& desired,
                 const Eigen::Ref<const VectorXd>& sigma_prime);

  /// V_dot (Sigma_o) and xi_dot (n) that follow where the terms that the law leaves out are zero.
  [[nodiscard]] const Vector6d& V_Bo_dot() const { return V_Bo_dot_; }
  [[nodiscard]] const VectorXd& xi_dot_d() const { return xi_dot_d_; }
  /// F_o (Sigma_o), N, N m.
  [[nodiscard]] const Vector6d& F_o() const { return F_o_; }
  /// E_bar' tau_0 (n), N, N m.
  [[nodiscard]] const VectorXd& force() const { return force_; }

 private:
  void SetOperationalSpace(const ModelTerms& robot, const GraspTerms& grasp, const DesiredMotion& desired,
                           const Eigen::Ref<const VectorXd>& sigma_prime);
  [[nodiscard]] Vector6d CalcWrench(const GraspTerms& grasp, const ObjectErrors& errors) const;

  ControlLaw law_;
  Options options_;
  ObjectSpaceInertia inertia_;
  Pseudoinverse J_B_pinv_;
  Vector6d V_Bo_dot_ = Vector6d::Zero();
  Vector6d F_o_ = Vector6d::Zero();
  VectorXd xi_d_, xi_dot_d_, force_, work_;  // n
  VectorXd rates_;                           // k
};

}  // namespace dexcheck
