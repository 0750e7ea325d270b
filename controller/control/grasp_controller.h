#pragma once

// The whole law of section 5, or one that it is compared with, as one step: measured state in, torques out.

#include <optional>
#include <span>

#include "controller/common/errors.h"
#include "controller/control/baseline_law.h"
#include "controller/control/computed_torque.h"
#include "controller/control/grasp_model.h"
#include "controller/control/object_tracking.h"
#include "controller/grasp/grasp_force.h"

namespace dexcheck {

/// No contact forces inside the friction cones give the wrench that the motion takes, or it is not finite.
class GraspForceError : public Error {
 public:
  using Error::Error;
};

/// @throws GraspForceError that says why, unless there is a solution.
void RequireGraspForce(const GraspForceResult& result);

/// Options of the grasp controller.
struct GraspControllerOptions : GraspModelOptions {
  explicit GraspControllerOptions(const RobotModel& model) : posture(model) {}

  ControlLaw law = ControlLaw::kComputedTorque;
  ObjectGains gains;
  ObjectStiffness stiffness;  ///< Of the laws that have one.
  RedundancyWeight weight;
  PostureTask posture;
  double mu = 0.5;       ///< Friction coefficient that the grasp force counts on.
  double f_min = 0.0;    ///< Least normal force of each finger, N.
  double f_max = 100.0;  ///< Largest, N.
  GraspForceOptions force;
};

/// The stage between the two of a law: F_o to contact forces inside the friction cones.
class GraspForceStage {
 public:
  /// @throws as GraspForceSolver.
  GraspForceStage(int num_contacts, const GraspControllerOptions& options);

  /// f_c (3N), N, with G f_c = F_o (Sigma_o). @param f_min least normal force of each finger, N.
  /// @throws GraspForceError when there are none, or F_o is not finite.
  const VectorXd& Solve(const GraspTerms& grasp, const Vector6d& F_o, double f_min);

  /// Time that the last problem took, s.
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  GraspForceProblem problem_;
  GraspForceSolver solver_;
  double seconds_ = 0.0;
};

/// Computed torque (55), or another law for the object, with the grasp force from the friction cones. Owns
/// every term that one step needs. Nothing allocates in Step.
class GraspController {
 public:
  /// @param fingertips frames that hold the object. @param object, surface in Sigma_o; surface outlives this.
  /// @throws what GraspTerms, ComputedTorque and GraspForceSolver throw.
  GraspController(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
                  const Surface& surface, const GraspControllerOptions& options);

  /// Evaluates the model at a state: M_bar', C_bar', F_bar', G, J_B' and their rates.
  void SetState(const MeasuredState& state);

  /// tau' (n), N m, for the state set and the desired motion at that instant.
  /// @throws SingularityError as ComputedTorque; GraspForceError when no contact force inside the friction
  /// cones holds the object.
  const VectorXd& CalcTorque(const DesiredMotion& desired);

  [[nodiscard]] const GraspModel& model() const { return model_.now(); }
  [[nodiscard]] const ModelTerms& robot() const { return model().robot(); }
  [[nodiscard]] const GraspTerms& grasp() const { return model().grasp(); }
  [[nodiscard]] const ComputedTorque& law() const { return law_; }
  /// sigma' (n) of the state set, from the posture task.
  [[nodiscard]] const VectorXd& sigma_prime() const { return sigma_prime_; }
  /// V_Bo_dot (Sigma_o) that the last torques demand of the object: what it would do if the law's terms were
  /// all there is.
  [[nodiscard]] const Vector6d& V_Bo_dot() const { return V_Bo_dot_; }
  /// F_N (k) of (49) that belongs to them, N.
  [[nodiscard]] const VectorXd& F_N() const { return F_N_; }
  /// Time that the last grasp-force problem took, s.
  [[nodiscard]] double force_seconds() const { return force_.seconds(); }
  [[nodiscard]] const GraspControllerOptions& options() const { return options_; }

 private:
  GraspControllerOptions options_;
  AlternatingModel model_;
  ComputedTorque law_;
  std::optional<BaselineLaw> baseline_;  // none for computed torque
  GraspForceStage force_;
  Vector6d V_Bo_dot_ = Vector6d::Zero();
  VectorXd sigma_prime_;  // n
  VectorXd F_N_;          // k
};

}  // namespace dexcheck
