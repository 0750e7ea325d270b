#pragma once

// Terms that a grasp adds to the robot's in one control step (sections 4.2 to 4.4): G, J_B', their rates
// along rolling contacts, and the object's terms. Fingers of one hand or of both, one hard-finger contact
// each; n entries of xi, k = 3N of f_c = [f_c1; ..; f_cN].

#include <span>
#include <vector>

#include "controller/common/types.h"
#include "controller/contact/grasp_map.h"
#include "controller/contact/shapes.h"
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
  void ListChains(const RobotModel& model);
  void SetBond(const Pose& X_Bf, const Vector6d& V_f, size_t finger);
  void CalcSlip(const VectorXd& xi, size_t finger);
  void RequireCoordinates() const;

  struct TipJacobian {
    Matrix6Xd J, J_dot;  // zero but for the columns of the fingertip's chain
  };

  std::vector<int> fingertips_;
  std::vector<Sphere> tips_;
  std::vector<std::vector<ColumnRun>> chains_;  // entries of xi that move each fingertip
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

}  // namespace dexcheck
