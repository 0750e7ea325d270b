#pragma once

#include "controller/control/controller.h"
#include "controller/control/grasp_model.h"
#include "controller/control/joint_law.h"
#include "controller/control/joint_motion.h"
#include "controller/control/trajectory_controller.h"

namespace dexcheck {

/// What a motion of joints demands of a controller: the start until Begin, then q_d(t).
class JointDemand {
 public:
  /// @param motion outlives this.
  JointDemand(const JointMotion& motion, double time_step) : motion_(&motion), time_step_(time_step) {}

  void Begin() { has_begun_ = true; }
  /// Fills `joints` as EvaluateDesired does, and says that nothing is held or carried.
  void Fill(const Reading& reading, double t, Command* command);

  /// q_d, q_d_ddot at t, and q_d_dot half a time step before. @param half_step scratch.
  static void EvaluateDesired(const JointMotion& motion, double t, double time_step, DesiredJoints* desired,
                              DesiredJoints* half_step);

 private:
  const JointMotion* motion_;
  double time_step_;
  bool has_begun_ = false;
  DesiredJoints half_step_;
};

/// A joint law along q_d(t), for a robot that holds nothing. It keeps the start until Begin.
class JointController final : public Controller {
 public:
  /// @param model of the robot without contacts: the grasp in it has none. @param motion outlives this.
  /// @throws as JointLaw and GraspModel; std::invalid_argument unless sampling.hold > 0.
  JointController(const RobotModel& model, const MassProperties& object, const Surface& surface,
                  ControlLaw law, const JointGains& gains, const JointMotion& motion,
                  const Sampling& sampling);

  /// No motion of an object is followed.
  void Follow(const Trajectory& motion) override;
  void Begin(double t, const Reading& reading) override;
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] const GraspModel& model() const override { return model_; }

 private:
  GraspModel model_;
  JointLaw law_;
  JointDemand demand_;
  Sampling sampling_;
  long steps_until_due_ = 0;
};

}  // namespace dexcheck
