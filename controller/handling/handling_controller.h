#pragma once

// The law of section 5 before, while and after the object is held: computed torque for any set of contacts,
// with an object that lies on a support, hangs in the hand, or is between the two.

#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "controller/control/computed_torque.h"
#include "controller/control/grasp_terms.h"
#include "controller/control/trajectory_controller.h"

namespace dexcheck {

// A grasp in the making: the terms of those of its fingertips that touch.

/// G, J_B' and their rates of some fingertips of a grasp, by the same order.
class PartialGrasp {
 public:
  /// @param fingertips of the whole grasp. @param set not empty. Else as GraspTerms.
  PartialGrasp(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
               const Surface& surface, ContactSet set);

  /// @param state of the whole grasp. @throws as GraspTerms.
  void SetState(const ModelTerms& robot, const MeasuredState& state);

  [[nodiscard]] const GraspTerms& terms() const { return terms_; }
  /// Places in the whole grasp.
  [[nodiscard]] const std::vector<size_t>& members() const { return members_; }

  /// Forces of the part (k) to those of the whole grasp (3N), the others zero.
  void Scatter(const Eigen::Ref<const VectorXd>& part, Eigen::Ref<VectorXd> whole) const;

 private:
  std::vector<size_t> members_;
  GraspTerms terms_;
  std::vector<ContactCoordinates> kappa_;
  std::vector<double> overlap_;
};

/// Demand on the hand at one instant. Every force in it may be changed steadily, so that torques do not
/// jump where one phase of a task follows another.
struct HandlingDemand {
  ContactSet contacts = 0;  ///< Fingertips that push; none: (18) alone.
  /// Normal force of each fingertip of the grasp, N, while the object lies on its support.
  std::vector<double> touch_force;
  /// From the touch forces (0) to the grasp forces inside the friction cones (1). More than 0 needs all
  /// contacts.
  double grip = 0.0;
  double f_min = 0.0;   ///< Least normal force of the grasp forces, N.
  double weight = 0.0;  ///< Part of the object's stated weight that the hand bears.
  double scale = 1.0;   ///< The object's mass over its stated one, once it has been weighed.
  /// J^+ is weighted by M_bar': what a fingertip's contact stops is then stopped by the finger, not by the
  /// whole robot. Otherwise by the controller's weight.
  bool by_inertia = false;
  bool carried = false;  ///< The object follows `desired`; otherwise it is to stay where it lies.
  DesiredMotion desired;
};

/// Computed torque for a HandlingDemand:
///   xi_dot_d = J^+ (G_dot^T V + G^T V_dot - J_dot xi_c) + N sigma',   J, G of the contacts
///   F_o      = scale (M_hat V_dot + C_hat V) + weight N_o
///   f_c      = (1 - grip) f_touch + grip f(F_o),   f(F_o) in the friction cones, G f = F_o
///   E_bar' tau' = M_bar' xi_dot_d + C_bar' xi_c + F_bar' + J^T f_c
/// With all contacts, grip = weight = scale = 1 it is (55). Allocates when a set of contacts comes up for the
/// first time, and never again.
class HandlingController {
 public:
  /// @param options gains, weight and limits; the posture task is the caller's. All else must outlive this.
  HandlingController(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
                     const Surface& surface, const GraspControllerOptions& options);

  /// tau' (n), N m.
  /// @param terms evaluated at `state`. @param sigma_prime (n) null-space acceleration (PostureTask).
  /// @throws GraspForceError when no admissible forces give F_o; SingularityError as ComputedTorque;
  /// std::invalid_argument when grip is positive without all contacts.
  const VectorXd& CalcTorque(const GraspModel& terms, const MeasuredState& state,
                             const HandlingDemand& demand, const Eigen::Ref<const VectorXd>& sigma_prime);

  /// V_Bo_dot (Sigma_o) that the torques demand of the object; zero unless it is carried.
  [[nodiscard]] const Vector6d& V_Bo_dot() const { return V_Bo_dot_; }
  /// xi_dot_d (n) of the torques.
  [[nodiscard]] const VectorXd& xi_dot_d() const { return xi_dot_d_; }
  /// f_c (3N) that belongs to the torques, zero without contact.
  [[nodiscard]] const VectorXd& f_c() const { return f_c_; }
  /// Time that the last grasp-force problem took, s.
  [[nodiscard]] double force_seconds() const { return force_seconds_; }

 private:
  struct Law {
    Law(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
        const Surface& surface, const RedundancyWeight& weight, ContactSet set)
        : grasp(model, fingertips, object, surface, set),
          torque(model, static_cast<int>(grasp.members().size()), weight) {}
    PartialGrasp grasp;
    ComputedTorque torque;
    VectorXd f_c;
  };
  Law& FindLaw(ContactSet set, bool by_inertia);

  const RobotModel* model_;
  std::vector<int> fingertips_;
  MassProperties object_;
  const Surface* surface_;
  GraspControllerOptions options_;
  std::map<std::pair<ContactSet, bool>, std::unique_ptr<Law>> laws_;
  GraspForceStage force_;
  Vector6d V_Bo_dot_ = Vector6d::Zero();
  VectorXd xi_dot_d_;  // n
  VectorXd f_c_;       // 3N
  double force_seconds_ = 0.0;
};

}  // namespace dexcheck
