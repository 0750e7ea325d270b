#pragma once

// The question about the law, for a robot that holds nothing and follows a motion of its joints.

#include <string>
#include <vector>

#include "controller/control/joint_law.h"
#include "controller/control/joint_motion.h"
#include "controller/dynamics/tree_factor.h"
#include "harness/checks/law_reference.h"
#include "harness/checks/step_record.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// What one step says of the law.
struct JointLawErrors {
  /// |tau' - tau'_printed| against the forces that the motors balance, in the metric of the robot's inertia.
  double torque = 0.0;
  /// Largest distance of a joint from where e_ddot + K_v e_dot + K_p e = 0, integrated from t = 0 and driven
  /// by the accelerations that the prediction missed, has it; rad or m.
  double error_dynamics = 0.0;
};

/// Computes the scenario's law at each step from the engine's terms, the scenario's gains and its motion.
class JointLawCheck {
 public:
  /// @param setup of a scenario that moves joints.
  explicit JointLawCheck(const Setup& setup);

  /// Largest eigenvalue of the error's dynamics as the controller samples them, over all joints.
  [[nodiscard]] double sampled_radius() const;
  /// Whether the closed loop is e_ddot + K_v e_dot + K_p e = 0.
  [[nodiscard]] bool has_error_dynamics() const { return law_ == ControlLaw::kComputedTorque; }
  /// Whether it can be integrated beside the run, which a plant of another integrator leaves at each step.
  [[nodiscard]] bool follows_error() const {
    return has_error_dynamics() && hold_ == 1 && velocity_age_ > 0.0;
  }

  /// @param terms the engine's, at the state that the controller was told.
  /// @param xi_dot_model what the rigid robot does under its torques.
  const JointLawErrors& Compare(const StepRecord& step, const VectorXd& xi_dot_model, const LawTerms& terms);
  /// Likewise the torques alone, of a step that the motors refuse.
  double CompareUnsent(const StepRecord& step, const LawTerms& terms);
  /// At which joints the torques differed, and by how much at most; empty for none.
  [[nodiscard]] std::string Tell() const;

 private:
  void CompareTorque(const StepRecord& step, const LawTerms& terms);
  void FollowError(const StepRecord& step, const VectorXd& xi_dot_model);
  /// K_v e_dot + K_p e + q_d_ddot.
  void CalcDemand(const VectorXd& q, const VectorXd& xi, VectorXd* xi_dot) const;

  ControlLaw law_;
  JointGains gains_;
  const JointMotion* motion_;
  double time_step_;
  double velocity_age_;
  long hold_;
  std::vector<std::string> names_;
  TreeFactor factor_;
  DesiredJoints desired_, half_step_;
  JointLawErrors errors_;
  VectorXd force_, demand_, true_demand_;  // n
  VectorXd work_;                          // n
  VectorXd differed_;                      // n, N m
  bool follows_ = false;                   // whether the two below are set
  VectorXd q_, xi_;
};

}  // namespace dexcheck
