#pragma once

#include <optional>

#include "controller/control/contact_follower.h"
#include "controller/control/controller.h"
#include "controller/control/grasp_controller.h"

namespace dexcheck {

/// When a controller computes, against the time steps of what it controls.
struct Sampling {
  double time_step = 0.0;  ///< Velocities belong to the middle of the step before (leapfrog), s; 0 for none.
  long hold = 1;           ///< Torques are computed at every hold-th Step and kept in between.
  /// Where contacts are followed by (40) from the run's beginning on: how Steps follow each other. Otherwise
  /// they are where the reading has them.
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
