#pragma once

// A control law as the checks judge it: computed a second time, from the terms of another provider.

#include <memory>
#include <optional>
#include <span>

#include "controller/control/constrained_dynamics.h"
#include "controller/dynamics/tree_factor.h"
#include "controller/model/platform.h"
#include "harness/checks/law_inputs.h"
#include "harness/checks/step_analysis.h"
#include "harness/checks/step_record.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// Returns the largest magnitude of the eigenvalues of (57) over all six axes, per time step, when the
/// command is held for `hold` steps; a loop with 1 or more does not settle. @param velocity_age by how much
/// velocities are older than positions, s: half a time step where velocities step first and positions by
/// them, 0 where both step together.
double CalcSampledRadius(const ObjectGains& gains, double time_step, long hold, double velocity_age);

/// Reads the terms of a law at a state from the controller's own model. @param terms keeps pointers into it.
void ReadTerms(const GraspModel& model, const VectorXd& q, const VectorXd& xi, LawTerms* terms);

/// One law: reference torques, demanded accelerations, error dynamics, and the spectral radius of the sampled
/// closed loop. A law may lack some of them.
class JudgedLaw {
 public:
  virtual ~JudgedLaw() = default;

  /// Spectral radius by the scenario's gains; none where the closed loop has no error dynamics of its own.
  [[nodiscard]] virtual std::optional<double> CalcSpectralRadius() const = 0;
  /// Whether the rigid system answers with the accelerations that the law demands, as under the paper's law.
  [[nodiscard]] virtual bool has_demand() const { return false; }
  /// Whether the error dynamics can be integrated beside the run: no foot holds the robot back, and the
  /// controller computes at every step, with velocities of the middle of the step before.
  [[nodiscard]] bool follows_error() const {
    return CalcSpectralRadius().has_value() && hold_ == 1 && !accelerates_within_step() && !stands_;
  }
  /// Whether these torques were computed at their step, by this law.
  [[nodiscard]] virtual bool IsComputed(const Command& command) const = 0;

  /// @param terms another provider's, at the measured state. @param plant the analysis of the same step.
  /// @param as_commanded whether nothing but the commanded torques moved the plant, so that its prediction is
  /// that of the law.
  virtual const LawErrors& Compare(const StepRecord& step, const LawTerms& terms, const StepAnalyzer& plant,
                                   bool as_commanded) = 0;
  /// Compares the torques alone, for a step that the motors refuse, and while everything settles.
  double CompareTorque(const StepRecord& step, const LawTerms& terms);
  /// Follows this motion of the object from now on, whose time is 0 at `begin`, s; null for that of the
  /// scenario. The motion outlives its use.
  virtual void Follow(const Trajectory* /*motion*/, double /*begin*/) {}

  /// Whether the torques of the last step that was compared are not the law's.
  [[nodiscard]] bool differs() const { return differs_; }
  /// Force that the bound of `law_torque` is relative to, in |.|_M^-1.
  [[nodiscard]] double noise_scale() const { return scale_ * condition_number(); }
  /// Steps whose torques were not the law's, since the last Forget.
  [[nodiscard]] const LawHistory& history() const { return history_; }
  void Forget() { history_.Forget(); }

  // The law with changed inputs, and its parts.

  /// The inputs of a step, with the force of the right law: empty where it has none.
  [[nodiscard]] LawInputs MakeInputs(const StepRecord& step, const LawTerms& terms);
  /// E_bar' tau' (n); empty where these inputs have none.
  [[nodiscard]] virtual VectorXd CalcForce(const LawInputs& inputs) = 0;
  [[nodiscard]] virtual std::span<const LawPartName> ListParts() const = 0;
  /// "K_p of x".
  [[nodiscard]] const std::vector<std::string>& gains() const { return gain_names_; }
  /// Makes one of the gains zero.
  virtual void RemoveGain(size_t gain, LawInputs* inputs) const = 0;
  /// Whether the law demands an acceleration, which M_bar' makes a force.
  [[nodiscard]] virtual bool demands_acceleration() const = 0;
  /// Time between two steps at which it is computed, s.
  [[nodiscard]] double control_step() const { return static_cast<double>(hold_) * time_step_; }

 protected:
  explicit JudgedLaw(const Setup& setup);
  /// E_bar' tau' (n) of the reference law; false when it has none.
  virtual bool Evaluate(const StepRecord& step, const LawTerms& terms) = 0;
  [[nodiscard]] virtual const VectorXd& force() const = 0;
  /// Scale of the torques' error. @param balanced |C_bar' xi + F_bar'|_M^-1.
  [[nodiscard]] virtual double CalcScale(double balanced) { return balanced; }
  [[nodiscard]] virtual double condition_number() const { return 1.0; }
  /// Copies the desired motion of the last Evaluate.
  virtual void CopyDesired(LawStep* state) const = 0;
  /// Copies the other inputs of the last Evaluate.
  virtual void CopyInputs(const StepRecord& step, LawInputs* inputs) const = 0;
  /// LawErrors::torque, after Evaluate, and `scale_`. @param factor of M_bar' = L^T L.
  double CalcTorqueError(const StepRecord& step, const LawTerms& terms, const TreeFactor& factor);
  /// |f|_M^-1 = |L^-T f|
  double Norm(const VectorXd& f) { return factor_->CalcForceNorm(f, &work_); }
  /// Whether the plant does not step by Euler's method.
  [[nodiscard]] bool accelerates_within_step() const { return velocity_age_ == 0.0; }

  double time_step_, velocity_age_;  // s
  long hold_;                        // steps
  bool stands_;                      // the ground takes part in the error dynamics
  double torque_bound_;              // of law_torque, as the scenario's tolerance raises it
  bool has_digits_;                  // the model is the engine's within the digits that files print
  ActuationMap actuation_;
  ConstrainedDynamics commanded_;  // the controller's rigid system under the commanded torques
  TreeFactor own_factor_;          // of the terms' M_bar'
  const TreeFactor* factor_ = nullptr;
  VectorXd difference_;  // n, E_bar' (tau' - tau'_printed)
  std::vector<std::string> gain_names_;
  double scale_ = 1.0;
  LawErrors errors_;

 private:
  void Remember(const StepRecord& step, const LawTerms& terms);
  /// By these terms, after Evaluate.
  void RememberEvaluated(const StepRecord& step, const LawTerms& terms);
  /// Copies the state and the force of the last Evaluate.
  void FillStep(const StepRecord& step, const LawTerms& terms, LawStep* state) const;
  [[nodiscard]] LawInputs CopyAll(const StepRecord& step, const LawTerms& terms, LawStep now) const;

  bool differs_ = false, exceeds_ = false;
  LawStep state_;
  LawHistory history_;
  VectorXd balanced_, work_;  // n
  VectorXd least_;            // n, RoundingScales::CalcLeastForces
};

/// The paper's (55), or one of those that it is compared with, by the scenario.
std::unique_ptr<JudgedLaw> MakeObjectLaw(const Setup& setup);
/// That of the joints, for a robot that holds nothing.
std::unique_ptr<JudgedLaw> MakeJointLaw(const Setup& setup);

}  // namespace dexcheck
