#pragma once

#include <optional>
#include <span>
#include <vector>

#include "controller/common/errors.h"
#include "controller/contact/shapes.h"
#include "controller/control/baseline_law.h"
#include "controller/control/computed_torque.h"
#include "controller/control/controller.h"
#include "controller/control/grasp_terms.h"
#include "controller/dynamics/model_terms.h"
#include "controller/grasp/grasp_force.h"

namespace dexcheck {

// The whole law of section 5, or one that it is compared with, as one step: measured state in, torques out.

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

  [[nodiscard]] const GraspModel& model() const { return model_; }
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
  GraspModel model_;
  ComputedTorque law_;
  std::optional<BaselineLaw> baseline_;  // none for computed torque
  GraspForceStage force_;
  Vector6d V_Bo_dot_ = Vector6d::Zero();
  VectorXd sigma_prime_;  // n
  VectorXd F_N_;          // k
};

// Contact coordinates that are followed and not measured: (40) from where the contacts began, as in the
// paper.

/// When a state's velocities are, and how far states are apart.
struct StateTiming {
  double time_step = 0.0;     ///< From one state to the next, s.
  double velocity_age = 0.0;  ///< By how much velocities are older than positions, s: half a step, or 0.
};

/// Integrates (40) beside a motion that is known at time steps. Nothing allocates after construction.
class ContactFollower {
 public:
  /// @param fingertips frames that carry spheres. @param surface of the object; must outlive this.
  ContactFollower(const RobotModel& model, std::span<const int> fingertips, const Surface& surface,
                  const StateTiming& timing);

  /// kappa (39) of each contact: at the first state as it has them, then moved by
  ///
  ///   kappa(t) = kappa(t - dt) + integral of kappa_dot(kappa, V_f, V_Bo),
  ///
  /// with both body velocities those of the middle of the step: J_f xi - dt/2 J_f_dot xi where velocities are
  /// half a step old, otherwise the mean of both ends. Slip is part of them.
  /// @throws what CalcKappaDot throws.
  const std::vector<ContactCoordinates>& Follow(const MeasuredState& state);
  [[nodiscard]] const std::vector<ContactCoordinates>& kappa() const { return kappa_; }

 private:
  /// Body velocities of one contact's bodies.
  struct Velocities {
    Vector6d V_f = Vector6d::Zero();   // of the fingertip, in its frame
    Vector6d V_Bo = Vector6d::Zero();  // of the object, Sigma_o
  };
  [[nodiscard]] Velocities CalcVelocities(const MeasuredState& state, size_t finger);

  ModelTerms robot_;
  std::vector<int> fingertips_;
  std::vector<Sphere> tips_;
  const Surface* surface_;
  StateTiming timing_;
  Matrix6Xd J_f_, J_f_dot_;
  bool has_begun_ = false;
  std::vector<ContactCoordinates> kappa_;
  std::vector<Velocities> last_;
};

/// When a controller computes, against the time steps of what it controls.
struct Sampling {
  double time_step = 0.0;  ///< Velocities belong to the middle of the step before (leapfrog), s; 0 for none.
  long hold = 1;           ///< Torques are computed at every hold-th Step and kept in between.
  /// Timing of the steps when contacts are integrated by (40) from the run's beginning; without it contacts
  /// are those of the reading.
  std::optional<StateTiming> contacts = std::nullopt;
};

/// Computed torque (55) along a trajectory X_d(t).
class TrajectoryController final : public Controller {
 public:
  /// @throws as GraspController; std::invalid_argument unless sampling.hold > 0.
  TrajectoryController(const RobotModel& model, std::span<const int> fingertips, const MassProperties& object,
                       const Surface& surface, const GraspControllerOptions& options,
                       const Sampling& sampling);

  void Follow(const Trajectory& motion) override;
  void Begin(double t, const Reading& reading) override;
  /// @throws std::logic_error before Follow; else as GraspController.
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] const GraspModel& model() const override { return law_.model(); }
  /// kappa (39) of each contact that is followed; empty before Begin, and where contacts are measured.
  [[nodiscard]] const std::vector<ContactCoordinates>& followed_kappa() const { return followed_.kappa; }

  /// Fills in the parts of a command that do not depend on torques, for an object that is held and moved.
  static void BeginCommand(const Trajectory& motion, double t, double time_step, Command* command);
  /// X_d, X_d_ddot at t, and X_d_dot half a time step before.
  [[nodiscard]] static DesiredMotion EvaluateDesired(const Trajectory& motion, double t, double time_step);

 private:
  GraspController law_;
  Sampling sampling_;
  std::optional<ContactFollower> follower_;
  bool has_begun_ = false;
  MeasuredState followed_;  // the last reading with contacts as they were followed
  const Trajectory* motion_ = nullptr;
  long steps_until_due_ = 0;
};

}  // namespace dexcheck
