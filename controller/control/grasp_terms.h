#pragma once

// Terms that a grasp adds to the robot's in one control step (sections 4.2 to 4.4): G, J_B', their rates
// along rolling contacts, and the object's terms. Fingers of one hand or of both, one hard-finger contact
// each; n entries of xi, k = 3N of f_c = [f_c1; ..; f_cN].

#include <cstddef>
#include <span>
#include <vector>

#include "controller/common/types.h"
#include "controller/contact/grasp_map.h"
#include "controller/contact/shapes.h"
#include "controller/control/reading.h"
#include "controller/control/trajectory.h"
#include "controller/dynamics/model_terms.h"
#include "controller/object/object_dynamics.h"

namespace dexcheck {

/// A contact point that is fixed on fingertip and object, as by a ball joint: the paper's contacts
/// before 4.3, and a reference without rolling and slip.
struct Bond {
  Vector3d p_f = Vector3d::Zero();  ///< Of the point in the fingertip frame, m.
  Pose g_o_cf = Pose::Identity();   ///< Sigma_cf, fixed in the object.
};

/// Workspace for the terms of one grasp at one state. Sized by the constructor; nothing else allocates.
class GraspTerms {
 public:
  /// @param fingertips frames of the model that carry spheres, one contact each.
  /// @param object mass properties in Sigma_o, com zero. @param surface of the object, in Sigma_o; must
  /// outlive this.
  /// None for a robot that holds nothing.
  /// @throws std::invalid_argument when a frame carries no sphere.
  GraspTerms(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
             const Surface& surface);

  /// All terms at the object's X_o, X_o_dot (19).
  /// @param robot with its state set; M, C, F are not used. @param kappa one for each fingertip (39).
  /// @throws std::invalid_argument when sizes differ; what CalcKappaDot throws.
  void SetState(const ModelTerms& robot, const Vector6d& X_o, const Vector6d& X_o_dot,
                std::span<const ContactCoordinates> kappa);
  /// Sets the state by a pose and a body velocity V_Bo, also where ZYZ angles are singular; coordinates() is
  /// then not available.
  void SetPose(const ModelTerms& robot, const Pose& X_Bo, const Vector6d& V_Bo,
               std::span<const ContactCoordinates> kappa);

  /// How deep the bodies at each contact overlap (m) in the states to come, where contacts are not rigid: see
  /// CalcContactGeometry. Zero until set. @throws std::invalid_argument unless there is one for each
  /// fingertip.
  void SetOverlaps(std::span<const double> overlaps);

  /// From now on the contacts are bonds; kappa is then kept but moves nothing, kappa_dot and G_dot are zero.
  /// @throws std::invalid_argument unless there is one for each fingertip.
  void SetBonds(std::span<const Bond> bonds);

  [[nodiscard]] int num_contacts() const { return static_cast<int>(fingertips_.size()); }
  /// k, entries of f_c.
  [[nodiscard]] int num_forces() const { return 3 * num_contacts(); }
  [[nodiscard]] const std::vector<int>& fingertips() const { return fingertips_; }
  [[nodiscard]] const MassProperties& object() const { return object_; }
  [[nodiscard]] const Vector3d& gravity() const { return gravity_; }
  /// Surface of the object and of a finger's tip.
  [[nodiscard]] const Surface& surface() const { return *surface_; }
  [[nodiscard]] const Surface& tip(int finger) const { return tips_[static_cast<size_t>(finger)]; }

  /// Contact frames and kappa_dot (40), which follows the motion that the state has, slip included.
  [[nodiscard]] std::span<const Contact> contacts() const { return contacts_; }
  /// G (6 x k), (25), and its rate.
  [[nodiscard]] const Matrix6Xd& G() const { return G_; }
  [[nodiscard]] const Matrix6Xd& G_dot() const { return G_dot_; }
  /// J_B' (k x n), (44), and its rate.
  [[nodiscard]] const MatrixXd& J_B() const { return J_B_; }
  [[nodiscard]] const MatrixXd& J_B_dot() const { return J_B_dot_; }
  /// Body Jacobian of a finger's tip in the fingertip frame, 6 x n, and its rate.
  [[nodiscard]] const Matrix6Xd& J_f(int finger) const {
    return tip_jacobians_[static_cast<size_t>(finger)].J;
  }
  [[nodiscard]] const Matrix6Xd& J_f_dot(int finger) const {
    return tip_jacobians_[static_cast<size_t>(finger)].J_dot;
  }
  /// Entries of xi that move any of the fingertips, ascending: the other columns of J_B' are zero.
  [[nodiscard]] std::span<const int> moving_entries() const { return moving_entries_; }
  /// Pose and body velocity of the object.
  [[nodiscard]] const Pose& X_Bo() const { return X_Bo_; }
  [[nodiscard]] const Vector6d& V_Bo() const { return V_Bo_; }
  /// M_hat V_Bo_dot + C_hat V_Bo + N_o = F_o, in Sigma_o.
  [[nodiscard]] const ObjectBodyTerms& body() const { return body_; }
  /// X_o and its rate, and the terms of (19), (45) in them: P^-1, d/dt P^-1, M_o, C_o, N_o.
  /// @throws std::logic_error after SetPose.
  [[nodiscard]] const Vector6d& X_o() const;
  [[nodiscard]] const Vector6d& X_o_dot() const;
  [[nodiscard]] const ObjectTerms& coordinates() const;

  /// Residual of (45): J_B' xi - G^T V_Bo (k), m/s; in each Sigma_cf, of finger against object.
  [[nodiscard]] const VectorXd& slip() const { return slip_; }
  /// The part of (46) without accelerations: J_B_dot' xi - G_dot^T V_Bo (k), m/s^2. The residual of (46) is
  /// J_B' xi_dot + slip_bias - G^T V_Bo_dot.
  [[nodiscard]] const VectorXd& slip_bias() const { return slip_bias_; }

 private:
  void SetContacts(const ModelTerms& robot, std::span<const ContactCoordinates> kappa);
  void SetBond(const Pose& X_Bf, const Vector6d& V_f, size_t finger);
  void CalcSlip(const VectorXd& xi, size_t finger);
  void RequireCoordinates() const;

  struct TipJacobian {
    Matrix6Xd J, J_dot;
  };

  std::vector<int> fingertips_;
  std::vector<Sphere> tips_;
  std::vector<int> moving_entries_;
  MassProperties object_;
  Vector3d gravity_;
  const Surface* surface_;

  std::vector<double> overlaps_;
  std::vector<Bond> bonds_;  // none, or one for each finger
  std::vector<Contact> contacts_;
  Matrix6Xd G_, G_dot_;
  MatrixXd J_B_, J_B_dot_;
  std::vector<TipJacobian> tip_jacobians_;
  Pose X_Bo_ = Pose::Identity();
  Vector6d V_Bo_ = Vector6d::Zero();
  ObjectBodyTerms body_{};
  bool has_coordinates_ = false;
  Vector6d X_o_ = Vector6d::Zero();
  Vector6d X_o_dot_ = Vector6d::Zero();
  ObjectTerms coordinates_{};
  VectorXd slip_, slip_bias_;
};

// The last bracket of (55): the acceleration of the object that makes its error obey (57),
// E_ddot + K_v E_dot + K_p E = 0.

/// K_v (1/s) and K_p (1/s^2) of (55), one entry for each axis: x, y, z, then the three of the orientation
/// error.
struct ObjectGains {
  Vector6d K_v = Vector6d::Zero();
  Vector6d K_p = Vector6d::Zero();
};

/// Which orientation error (55) feeds back.
enum class OrientationFeedback {
  kAngles,    ///< E = X_d - X_o in ZYZ angles, as printed.
  kRotation,  ///< e_R = log(R_Bo^T R_Bd), regular at every pose.
};

/// V_Bo_dot (Sigma_o) for the command X_o_ddot = X_d_ddot + K_v (X_d_dot - X_o_dot) + K_p (X_d - X_o), (55):
/// V_Bo_dot = P^-1 X_o_ddot + d/dt(P^-1) X_o_dot.
/// @throws std::logic_error unless the grasp's state was set by X_o.
Vector6d CalcTrackingAcceleration(const ObjectGains& gains, const GraspTerms& grasp,
                                  const DesiredMotion& desired);

/// V_Bo_dot (Sigma_o) for position errors in the world and the orientation error e_R of so3.h; both obey
/// (57).
/// @param V_Bo body velocity at pose X_Bo.
Vector6d CalcTrackingAcceleration(const ObjectGains& gains, const Pose& X_Bo, const Vector6d& V_Bo,
                                  const DesiredPose& desired);

/// One of the two. kRotation also takes a grasp whose state was set by a pose.
Vector6d CalcTrackingAcceleration(const ObjectGains& gains, OrientationFeedback feedback,
                                  const GraspTerms& grasp, const DesiredMotion& desired);

/// How far the object is from its desired motion, as twists in Sigma_o.
struct ObjectErrors {
  /// kAngles: P^-1 (X_d - X_o); kRotation: [R_Bo^T (p_d - p_o); e_R]. m, rad.
  Vector6d e = Vector6d::Zero();
  /// V_d - V_Bo, the desired body velocity less the object's. m/s, rad/s.
  Vector6d V_error = Vector6d::Zero();
  /// Derivative of the desired twist V_d along the object's motion, m/s^2, rad/s^2.
  Vector6d V_d_dot = Vector6d::Zero();
};

/// kAngles: V_d = P^-1 X_d_dot; kRotation: V_d = [R_Bo^T p_d_dot; R_od omega_d]. At the object's own pose
/// either is the desired frame's body velocity. @throws as CalcTrackingAcceleration.
ObjectErrors CalcObjectErrors(OrientationFeedback feedback, const GraspTerms& grasp,
                              const DesiredMotion& desired);

// Everything that the paper's laws need of robot, object and contacts at one state.

struct GraspModelOptions {
  /// kAngles evaluates the object's terms in X_o besides, on one branch of the angles.
  OrientationFeedback orientation = OrientationFeedback::kAngles;
  Vector6d X_o_start = Vector6d::Zero();  ///< The angles' branch is the one nearest to this at first.
  std::vector<Bond> bonds;                ///< None, or one for each fingertip.
};

/// M_bar', C_bar', F_bar', G, J_B' and their rates, all at one state. Nothing allocates after construction.
class GraspModel {
 public:
  /// @param fingertips frames that hold the object. @param object, surface in Sigma_o; surface outlives this.
  /// @throws as GraspTerms.
  GraspModel(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
             const Surface& surface, const GraspModelOptions& options);

  /// Evaluates all terms at a state. @throws what GraspTerms and CalcP throw.
  void SetState(const MeasuredState& state);

  [[nodiscard]] const ModelTerms& robot() const { return robot_; }
  [[nodiscard]] const GraspTerms& grasp() const { return grasp_; }
  /// Whether X_o and the terms in it are evaluated.
  [[nodiscard]] bool has_coordinates() const { return orientation_ == OrientationFeedback::kAngles; }

 private:
  OrientationFeedback orientation_;
  ModelTerms robot_;
  GraspTerms grasp_;
  Vector6d X_o_;  // of the last state, to stay on one branch of the angles
};

}  // namespace dexcheck
