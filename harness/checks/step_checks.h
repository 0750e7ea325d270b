#pragma once

// Questions two to four of the cross-check, at every step of a run.
//
// Errors of forces and accelerations of the robot are measured in the metric of its own inertia, in which
// metres and radians, arms and phalanges weigh what they weigh: |a|_M = sqrt(a^T M_bar' a), |f|_M^-1 =
// sqrt(f^T M_bar'^-1 f), relative to |C_bar' xi + F_bar'|_M^-1, the force that the motors have to balance.

#include <limits>
#include <map>
#include <memory>
#include <string_view>
#include <vector>

#include "controller/control/actuation.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/handling/partial_grasp.h"
#include "harness/base/check_record.h"
#include "harness/checks/force_evidence.h"
#include "harness/checks/step_check_table.h"
#include "harness/checks/step_record.h"
#include "harness/checks/wheel_evidence.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

class PredictionCompliance;

/// Balance, prediction and assumptions. Nothing allocates after construction, except where a task's set of
/// contacts comes up for the first time.
///
/// Of a task each step is predicted with the contacts that it has: (46) for the fingertips that touch, and an
/// object that does not move while it lies on something. For kTransient after a contact has come, gone or
/// been let go, the prediction is not judged. How long that lasts in one go is a check itself.
class StepChecks {
 public:
  /// @throws InputError when a bound of the scenario has the name of no check.
  explicit StepChecks(const Setup& setup);
  ~StepChecks();
  StepChecks(const StepChecks&) = delete;
  StepChecks& operator=(const StepChecks&) = delete;
  /// Whether the scenario's bounds are those of checks, for a run that makes none. @throws InputError.
  static void RequireKnownBounds(const Scenario& scenario);

  /// Compares one step, whose response was read.
  void Compare(const StepRecord& step);
  /// Adds the value of a check that others measure.
  void Add(StepCheck which, double value, double time) { check(which).Add(value, time); }
  /// The same of a check that has parts: `describe` tells the one of a first failure, in words.
  template <typename Describe>
  void Add(StepCheck which, double value, double time, const Describe& describe) {
    CheckRecord& record = check(which);
    if (record.applies && !record.failed && !(value <= record.bound)) record.part = describe();
    record.Add(value, time);
  }
  /// Adds a residual: as it is up to the bound, and above it less what is known to be in it.
  void AddLess(StepCheck which, double residual, double known, double time);
  /// Takes checks out that this run cannot answer.
  void LeaveOut(StepCheck which) { check(which).applies = false; }
  /// M_bar' = L^T L of the last step that was judged; null before.
  [[nodiscard]] const TreeFactor* mass_factor() const {
    return predicted_by_ != nullptr ? &predicted_by_->mass_factor() : nullptr;
  }

  /// Adds the largest |tau'| / limit of a motor: before the step, which does not come when that is above 1.
  void JudgeEffort(double effort, double time) { check(StepCheck::kActuators).Add(effort, time); }

  /// Forgets all steps so far: time begins anew.
  void Reset();

  [[nodiscard]] const std::vector<CheckRecord>& checks() const { return checks_; }
  [[nodiscard]] const CheckRecord& Find(std::string_view name) const;
  /// Of the last step.
  [[nodiscard]] const StepFindings& findings() const { return findings_; }
  /// Of the forces that the balances leave, and of the wheels.
  [[nodiscard]] const ForceEvidence& forces() const { return forces_; }
  [[nodiscard]] const WheelEvidence& wheels() const { return wheels_; }

 private:
  void DefineChecks();
  /// Leaves out what this run cannot ask.
  void SetApplying();
  void MoveWindows(const MeasuredState& state);
  [[nodiscard]] CheckRecord& check(StepCheck which) { return checks_[static_cast<size_t>(which)]; }
  void Add(StepCheck which, double value) { check(which).Add(value, time_); }
  /// Contacts of a task, and how the rigid system behaves with them.
  struct PartialDynamics {
    PartialDynamics(const Setup& setup, ContactSet set);
    PartialGrasp grasp;
    ConstrainedDynamics dynamics;
  };
  /// A contact one step ago.
  struct LastContact {
    ContactCoordinates kappa;
    ContactGeometry geometry;
    Pose X_of = Pose::Identity();  // of the fingertip to the object
  };
  void CompareContacts(const StepRecord& step);
  void FindContacts(const StepRecord& step);
  void Predict(const StepRecord& step);
  void PredictPart(const StepRecord& step);
  /// To the forces that are known.
  void AddFrictionAndStops(const StepRecord& step);
  void CompareDynamics(const StepRecord& step);
  /// Adds the friction of wheels that spin, which (48) has at the rates of (1).
  void AddSpin(const StepRecord& step);
  /// Rates of the right and left wheel, rad/s.
  [[nodiscard]] Vector2d ReadWheelRates(const StepRecord& step) const;
  /// Largest force, in |.|_M^-1, that comes of the platform's tilt and of the tyres' slip.
  [[nodiscard]] double CalcUnevenForce(const StepRecord& step) const;
  /// |f|_M^-1 = |L^-T f|
  [[nodiscard]] double Norm(const VectorXd& force);
  void CompareObject(const StepRecord& step);
  /// Keeps what the balances leave, when one of them fails.
  void KeepForces(const StepRecord& step);
  void CompareRolling(const StepRecord& step);
  void ReadSlip(const StepRecord& step);
  void ForgetSlip();
  /// Of the object, N.
  [[nodiscard]] double Weight() const;
  void CheckIdleJoints(const MeasuredState& state);
  void CheckJointLimits(const MeasuredState& state);
  void CompareKappa(const StepRecord& step);
  /// By (40), from how fingertip and object have moved since the last step, in the charts of now.
  Vector5d CalcKappaChange(const StepRecord& step, size_t finger);
  /// Whether contacts are within the rims of hemispherical fingertips.
  void CheckRims(const StepRecord& step);

  const Setup* setup_;
  std::vector<CheckRecord> checks_;
  StepFindings findings_;
  ConstrainedDynamics dynamics_;
  ActuationMap actuation_;
  const ConstrainedDynamics* predicted_by_ = nullptr;  // of the last step that was judged
  std::map<ContactSet, std::unique_ptr<PartialDynamics>> parts_;
  Handling handling_;
  ContactSet touching_ = 0;
  bool supported_ = false;
  bool was_holding_ = false;
  double changed_at_ = -std::numeric_limits<double>::infinity();  // the contacts, s
  double excluded_since_ = 0.0;                                   // s, while it lasts
  bool is_excluded_ = false;
  /// Integrated from (40) since the window's beginning, and since the next one's.
  std::vector<ContactCoordinates> kappa_, next_kappa_;
  std::vector<LastContact> last_contacts_;
  VectorXd idle_start_;
  bool has_kappa_ = false;
  long steps_ = 0;
  double time_step_ = 0.0;
  double time_ = 0.0;
  VectorXd force_, bias_, residual_;  // n
  std::unique_ptr<PredictionCompliance> compliance_;
  VectorXd work_;          // n
  VectorXd contact_bias_;  // 3N, m/s^2, each in its Sigma_cf
  ForceEvidence forces_;
  WheelEvidence wheels_;
  VectorXd left_of_robot_;  // n, of the step's balance
  Vector6d left_of_object_ = Vector6d::Zero();
  double scale_ = 1.0;
  double solver_of_robot_ = 0.0;  // relative, as inverse_dynamics_robot
  double mass_ = 0.0;             // of the robot, kg
};

}  // namespace dexcheck
