#pragma once

#include <optional>
#include <span>
#include <vector>

#include "controller/contact/shapes.h"
#include "controller/control/controller.h"
#include "controller/control/grasp_controller.h"
#include "controller/control/grasp_model.h"
#include "controller/dynamics/model_terms.h"

namespace dexcheck {

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
