#pragma once

// All questions of a run, asked at every step.

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "controller/control/constrained_dynamics.h"
#include "harness/checks/attribution.h"
#include "harness/checks/joint_law_check.h"
#include "harness/checks/known_plant.h"
#include "harness/checks/law_check.h"
#include "harness/checks/signal_evidence.h"
#include "harness/checks/step_checks.h"
#include "harness/checks/step_model_check.h"
#include "harness/checks/step_record.h"
#include "harness/engine/clearance.h"

namespace dexcheck {

/// The checks of one run, with what went worst. Nothing allocates in a step, except as StepChecks and where a
/// check of the model fails for the first time.
class CrossCheck {
 public:
  /// @param motors of the plant.
  /// @throws InputError as EngineStep, or when a bound of the scenario has the name of no check.
  /// @param knows_law whether the controller's law is the scenario's; otherwise no check of the law is made.
  CrossCheck(const Setup& setup, std::span<const Motor> motors, bool knows_law = true);

  /// What the scenario itself asks for; null for an ideal plant. Once at each step, before the questions,
  /// also of those steps that are not asked about.
  const KnownStep* Follow(const StepRecord& step) { return known_ ? &known_->plant.Follow(step) : nullptr; }
  /// One more disturbance is known from now on; between steps. Of a plant that was ideal, joints that only
  /// stiffness holds are not judged any more.
  void Expect(const DisturbanceOptions& disturbance, std::span<const Motor> motors);
  /// Robot and object are elsewhere from now on, by `way` (m, world).
  void Translate(const Vector3d& way) {
    if (known_) known_->plant.Translate(way);
  }
  /// They move at `v` (m/s, world) more from now on.
  void AddVelocity(const Vector3d& v) {
    if (known_) known_->plant.AddVelocity(v);
  }

  /// The first question: are the terms that the controller used the engine's?
  void CompareModel(const StepRecord& step);
  /// The others, which compare motion and forces.
  void CompareMotion(const StepRecord& step) { motion_.Compare(step); }
  /// What is asked while everything settles: questions 3 and 4, whether motors give what they are sent, and
  /// whether bodies are apart.
  void CompareSettling(const StepRecord& step);
  /// The law's question: are the torques those of (53)-(55), and do they do what is expected? After the other
  /// two.
  void CompareLaw(const StepRecord& step);
  /// The first question and the law's, of torques that were not sent because they are above a motor's limit.
  void CompareUnsent(const StepRecord& step);
  /// The largest effort of a motor, before the step that it belongs to.
  void JudgeEffort(double effort, double time) { motion_.JudgeEffort(effort, time); }
  /// Forgets motion and forces of all steps so far, but for the checks that failed: time begins anew.
  void Reset();
  /// The same for the checks that failed, too.
  void Forget();
  /// Checks of motion and forces that failed before the last Reset, while everything settled, in that order.
  [[nodiscard]] std::span<const CheckRecord> settling_failures() const { return settling_failures_; }

  /// What was measured of each cause, in words.
  [[nodiscard]] MeasuredCauses Tell() const;
  [[nodiscard]] std::span<const CheckRecord> model_checks() const { return model_.records(); }
  [[nodiscard]] std::span<const CheckRecord> motion_checks() const { return motion_.checks(); }
  /// A check of the motion. @throws std::invalid_argument unless there is one of that name.
  [[nodiscard]] const CheckRecord& Find(std::string_view name) const { return motion_.Find(name); }
  /// Of the last step.
  [[nodiscard]] const StepFindings& findings() const { return motion_.findings(); }
  /// Of the bodies that are not meant to touch.
  [[nodiscard]] const Clearance& clearance() const { return clearance_; }

 private:
  /// What a plant that is not ideal needs besides.
  struct NotIdeal {
    NotIdeal(const Setup& setup, std::span<const Motor> motors);
    KnownPlant plant;
    /// Of the controller's terms at what it was told, by an engine without the scenario's mismatch.
    StepModelCheck controller;
  };
  /// Are bodies apart that are not meant to touch? At the state that the engine's terms were evaluated at.
  void CheckClearance(const StepRecord& step);
  static double CompareMeasurement(const StepRecord& step);
  /// The engine's at what the controller was told; contacts that need not fit together are the controller's.
  void ReadControllersTerms(const StepRecord& step);
  /// Did the joints get what was sent?
  void CompareMotors(const StepRecord& step);
  /// Whether nothing but the torques that were sent moved the plant: its prediction is then what was meant.
  [[nodiscard]] bool MovedAsMeant(const StepRecord& step) const;
  /// What the controller's rigid system does under the torques that were sent.
  void FindMeant(const StepRecord& step);
  /// Of torques that the controller computed at this step.
  const LawErrors& CompareControl(const StepRecord& step);
  void CompareJointLaw(const StepRecord& step);
  void CompareObjectLaw(const StepRecord& step);

  const Setup* setup_;
  StepModelCheck model_;
  StepChecks motion_;
  Clearance clearance_;
  MjDataPtr kinematics_;  // of a plant that has no bodies of the engine's
  std::optional<NotIdeal> known_;
  std::optional<LawCheck> law_;  // none for a task, an unknown law, or a motion of joints
  std::optional<JointLawCheck> joint_law_;
  LawTerms law_terms_;                                         // the engine's
  double position_by_law_ = -1.0, orientation_by_law_ = -1.0;  // largest; see MeasuredCauses
  double position_by_hold_ = 0.0, orientation_by_hold_ = 0.0;  // of the last step judged; see LawErrors
  std::vector<CheckRecord> settling_failures_;
  MotorEvidence motors_;
  SensorEvidence sensors_;
  ConstrainedDynamics meant_dynamics_;
  ActuationMap actuation_;
  VectorXd meant_force_, slip_acceleration_;  // n
  StepFindings meant_;                        // by FindMeant
};

}  // namespace dexcheck
