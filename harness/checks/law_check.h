#pragma once

// The question about the law: are the torques those of (53)-(55), and do they mean what they should?

#include <memory>

#include "controller/control/actuation.h"
#include "controller/control/trajectory.h"
#include "controller/dynamics/tree_factor.h"
#include "harness/checks/baseline_reference.h"
#include "harness/checks/law_attribution.h"
#include "harness/checks/law_reference.h"
#include "harness/checks/step_record.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// What one step says of the law. Each is relative to what rounding, or the named tolerance, can explain.
struct LawErrors {
  /// |E_bar' (tau' - tau'_printed)| against the forces that the motors balance, both in the metric of the
  /// robot's inertia, over the condition number of J_B'.
  double torque = 0.0;
  /// xi_dot, V_o_dot and f_c of the rigid system (46), (48) under tau' against what (47), (49), (55) demand,
  /// likewise; forces relative to |f_c|. The largest of them.
  double demand = 0.0;
  /// F_N by its certificate: the largest entry of G F_N, and how far f_c is outside its cones and bounds,
  /// both over max(1 N, |f_c|); the slope that the objective has left within null(G), over max(1, all of it).
  double grasp_null_space = 0.0, grasp_cone = 0.0, grasp_optimality = 0.0;
  /// Object's position against (57) integrated from t = 0 and driven by the accelerations that the prediction
  /// missed, m.
  double error_dynamics = 0.0;
  double orientation_dynamics = 0.0;  ///< Its orientation likewise, rad.
  /// How far from its desired pose the object would be if (57) alone drove it, m and rad: what the gains
  /// leave.
  double position_by_law = 0.0, orientation_by_law = 0.0;
  /// How far what the plant accelerates within a step, while torques and demand are held, leads away from
  /// (57), m and rad.
  double position_by_hold = 0.0, orientation_by_hold = 0.0;
};

/// Largest magnitude of the eigenvalues of (57), per time step, when the command is held for `hold` steps: 1
/// and more does not settle. Over all six axes. @param velocity_age by how much velocities are older than
/// positions, s: half a time step where velocities step first and positions by them, 0 where both step
/// together.
double CalcSampledRadius(const ObjectGains& gains, double time_step, long hold, double velocity_age);

/// Computes the scenario's law, as a rule the printed one, at each step, from the engine's terms, the
/// scenario's gains and the scenario's trajectory. Of the controller it takes F_N, which the law may choose,
/// X_o's angles on the law's branch (the first question compares their pose with the engine's), and C_bar',
/// J_B_dot' where they multiply what slips.
class LawCheck {
 public:
  /// @param setup of a scenario that is no task.
  explicit LawCheck(const Setup& setup);

  /// Whether this step's torques are those of (55): not in a task, and not while torques are held.
  [[nodiscard]] static bool IsJudged(const StepRecord& step) {
    return !step.command.handling.partial && step.command.force_solves > 0;
  }
  /// Of the scenario's gains.
  [[nodiscard]] double sampled_radius() const { return sampled_radius_; }
  /// Whether the law's closed loop is (57): that of the paper's, and by algebra that of operational space.
  [[nodiscard]] bool has_error_dynamics() const { return has_error_dynamics_; }
  /// Whether the rigid system answers with what the law demands of it: the paper's does.
  [[nodiscard]] bool has_demand() const { return baseline_ == nullptr; }
  /// Whether the controller computes anew at every step, so that (57) can be integrated beside it in the way
  /// that its velocities need: those of the middle of the step before.
  [[nodiscard]] bool follows_error() const {
    return has_error_dynamics_ && hold_ == 1 && !accelerates_within_step();
  }

  /// The law at the state that the controller was told, before Compare. @param terms the engine's there.
  void Evaluate(const StepRecord& step, const LawTerms& terms);
  [[nodiscard]] const LawReference& reference() const { return reference_; }

  /// @param terms as Evaluate.
  /// @param findings of the same step: what the rigid system does under its torques.
  /// @param knows_slip whether that starts from xi_c, as (47) plans, and not from xi: where contacts are told
  /// to slip the two differ, by what is otherwise taken off the demand.
  /// @param mass_factor of M_bar' = L^T L: the check measures in |f|_M^-1 = |L^-T f|.
  const LawErrors& Compare(const StepRecord& step, const StepFindings& findings, const LawTerms& terms,
                           const TreeFactor& mass_factor, bool knows_slip);
  /// The torques alone, for a step that the motors refuse: nothing is known of what they would do.
  double CompareUnsent(const StepRecord& step, const LawTerms& terms);
  /// Largest |tau' received - tau' sent| over the largest |tau'|.
  [[nodiscard]] static double CompareApplied(const StepRecord& step);

  /// Which part of the law differs, over all steps whose torques did.
  [[nodiscard]] const LawAttribution& attribution() const { return attribution_; }

 private:
  struct Followed {
    LawObject object;                   // velocities as old as the plant's
    Vector6d V_dot = Vector6d::Zero();  // from this step to the next
  };
  [[nodiscard]] DesiredMotion EvaluateDesired(double t) const;
  void CompareTorque(const StepRecord& step, const LawTerms& terms, const VectorXd& force);
  void CompareDemand(const StepFindings& findings, bool knows_slip);
  void CompareGraspForce(const StepRecord& step, const LawTerms& terms, const VectorXd& f_c);
  void FollowError(const StepRecord& step, const StepFindings& findings, const LawTerms& terms,
                   const DesiredMotion& desired);
  double Norm(const VectorXd& force);
  /// Whether a plant that does not step by Euler's method.
  [[nodiscard]] bool accelerates_within_step() const { return velocity_age_ == 0.0; }
  /// (57) by itself, and driven by what is held during a step, from the step before to this one.
  void FollowHeld(const LawObject& truth, const DesiredMotion& desired);
  /// As the plant steps, to the next step. @param change half of the change of p_ddot (world) and omega_dot
  /// within the step.
  void Move(const Vector6d& change, Followed* one) const;
  /// p_ddot (world) and omega_dot.
  static Vector6d CalcWorldAcceleration(const Followed& one);

  LawSpec spec_;
  double mu_, f_min_, f_max_, barrier_weight_;
  double time_step_;
  double velocity_age_;
  bool has_error_dynamics_ = true;
  long hold_;
  double sampled_radius_;
  std::unique_ptr<Trajectory> trajectory_;
  ActuationMap actuation_;
  LawReference reference_;
  DesiredMotion desired_;
  bool is_evaluated_ = false;                    // J_B' and G had full row rank
  std::unique_ptr<BaselineReference> baseline_;  // null for the paper's law
  LawAttribution attribution_;
  LawErrors errors_;
  const TreeFactor* mass_factor_ = nullptr;
  TreeFactor own_factor_;  // of a step without prediction
  double scale_ = 1.0;
  VectorXd force_, difference_, work_;      // n
  VectorXd slope_;                          // k
  bool follows_ = false;                    // whether those below are set
  Followed followed_, undisturbed_, held_;  // (57) driven by all, by nothing, by what is held
  Followed before_;                         // the plant's object, a step before
};

}  // namespace dexcheck
