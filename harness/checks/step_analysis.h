#pragma once

// Quantities that several checks share at a step: each is computed once, and has one name.
//
// Errors of forces and accelerations of the robot are measured in the metric of its own inertia, in which
// metres and radians, arms and phalanges weigh what they weigh: |a|_M = sqrt(a^T M_bar' a), |f|_M^-1 =
// sqrt(f^T M_bar'^-1 f), relative to |C_bar' xi + F_bar'|_M^-1, the force that the motors have to balance.

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "controller/control/constrained_dynamics.h"
#include "controller/handling/handling_controller.h"
#include "controller/model/platform.h"
#include "harness/checks/constraint_law.h"
#include "harness/checks/declared_plant.h"
#include "harness/checks/step_record.h"
#include "harness/checks/whole_robot.h"
#include "harness/engine/clearance.h"
#include "harness/engine/velocity_map.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// [v; w], m/s and rad/s, of a platform that rolls, (1). @param xi starts with the base's velocity.
Vector2d CalcRollingTwist(const Base& base, const VectorXd& xi);

/// Length of the slip window, s: distances are judged from a moment between half of it and all of it ago.
inline constexpr double kSlipWindow = 10.0;

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Errors of the law at one step, each relative to the error that rounding, or the named tolerance, can
/// explain. Errors begin as NaN, so that a check of an error that was never set fails; allowances begin as 0.
struct LawErrors {
  /// |E_bar' (tau' - tau'_printed)| against the forces that the motors balance, both in the metric of the
  /// robot's inertia, over the condition number of J_B'.
  double torque = kNaN;
  /// Largest difference of xi_dot, V_o_dot and f_c of the rigid system (46), (48) under tau' from the values
  /// that (47), (49), (55) demand, in the same metric; forces relative to |f_c|.
  double demand = kNaN;
  /// `demand` with the effect of contacts that slip included, and the size of that effect.
  double demand_residual = kNaN, demand_by_slip = 0.0;
  /// F_N by its certificate: the largest entry of G F_N, and how far f_c is outside its cones and bounds,
  /// both over max(1 N, |f_c|); the slope that the objective has left within null(G), over max(1, all of it).
  double grasp_null_space = kNaN, grasp_cone = kNaN, grasp_optimality = kNaN;
  /// Object's position, m, or largest distance of a joint, rad or m, against the error dynamics integrated
  /// from t = 0 and driven by the accelerations that the prediction missed.
  double error_dynamics = kNaN;
  double orientation_dynamics = kNaN;  ///< The same difference of the object's orientation, rad.
  /// Distance of the object from its desired pose if (57) alone drove it, m and rad.
  double position_by_law = kNaN, orientation_by_law = kNaN;
  /// Distance from (57) by the plant's acceleration within a step, while torques are held, m and rad.
  double position_by_hold = 0.0, orientation_by_hold = 0.0;
};

/// A value, and the index of its part of the robot, contact or pair of bodies; -1 for none.
using WorstPart = std::pair<double, int>;

/// Which fingertips and feet touch.
struct TouchFindings {
  ContactSet touching = 0;      ///< Fingertips that touch the object, or feet that bear something.
  bool begins_holding = false;  ///< Whether all fingertips should touch the object from this step on.
  /// Distance of each fingertip that touches, by the plant less by the declared shapes (N), m; 0 for others.
  VectorXd mismatch;
  double foot_gap = 0.0;    ///< Largest gap of a foot of a robot that stands and the ground, m.
  WorstPart foot_mismatch;  ///< Largest difference of a foot's distance by plant and declared shapes, m.
};

/// The largest over the contacts of one kind.
struct SlipSummary {
  double distance = 0.0;  ///< Within the window, less creep, m; of bonds the distance of the joined points.
  double rate = 0.0;      ///< Less creep, m/s.
  double cone_use = 0.0;
};

/// How contacts slip.
struct SlipFindings {
  SlipSummary fingertips, wheels, feet;
  bool is_window_end = false;  ///< Whether the window that distances are judged over moves on after the step.
};

/// How the right and the left wheel of a platform roll, (1).
struct RollingFindings {
  Vector2d rates = Vector2d::Zero();     ///< Against the ground, rad/s.
  Vector2d mismatch = Vector2d::Zero();  ///< v +- w b / 2 - r thetadot, m/s.
  Vector2d slip = Vector2d::Zero();      ///< Part of it that slip and tyres that give can explain, m/s.
};

/// The whole robot and its object (WholeRobot) against the engine: relative errors, each with its entry of nu
/// or its row.
struct WholeErrors {
  WorstPart residual = {kNaN, -1};  ///< Residual of the equations of motion, over the sizes that are summed.
  WorstPart mass = {kNaN, -1};      ///< M against the engine's.
  WorstPart bias = {kNaN, -1};      ///< Coriolis forces, gravity and friction against the engine's.
  WorstPart constraint = {kNaN, -1};  ///< ConstraintLaw::FindWorst.
};

/// One of (48) and (19) with the plant's accelerations and contact forces.
template <typename Vector>
struct Balance {
  /// M_bar' xi_dot + C_bar' xi + F_bar' + J_B'^T f_c - E_bar' tau' - ... (n), or M_hat V_o_dot + C_hat V_o +
  /// N_o - G f_c - ... (6).
  Vector residual;
  /// The scale of the errors: |C_bar' xi + F_bar'|_M^-1, at least that of
  /// RoundingScales::CalcLeastForces; the object's weight or the contact forces, N.
  double balanced = 1.0;
  double error = kNaN;   ///< Relative size of the residual; for the object, forces at the contacts' arm.
  double solver = kNaN;  ///< Relative size of the remaining error of the plant's solver.
};

/// The equations of motion at a step: those of the whole robot (WholeRobot) at the true state, or (48) of a
/// plant that is not the engine's; and (19), of the object.
struct MotionBalance {
  VectorXd q, nu, nu_dot;  ///< Of the robot.
  /// Their remainder with the torques that motors gave, N and N m: the robot's entries of nu, then the force
  /// on the object and its moment (Sigma_o), if there is one.
  VectorXd residual;
  VectorXd size;  ///< Sum of the magnitudes that each entry is the sum of.
};

/// Distance of the rigid constrained system under the same torques from the plant.
struct RigidErrors {
  /// xi_dot_model - xi_dot|_M relative to |xi_dot_model|_M, or to the balanced forces where they are larger.
  double acceleration = kNaN;
  double contact_force = kNaN;  ///< |f_c_model - f_c|, relative.
};

/// Analysis of one step; n entries of xi, 3N of f_c. Its pointers refer to the loop's own data.
struct StepAnalysis {
  const Setup* setup = nullptr;
  const StepRecord* step = nullptr;
  const DeclaredStep* declared = nullptr;
  TouchFindings contacts;
  SlipFindings slip;
  RollingFindings wheels;
  Balance<VectorXd> robot;
  Balance<Vector6d> object{.residual = Vector6d::Zero()};
  WholeErrors whole;
  MotionBalance motion;
  RigidErrors rigid;
  std::optional<LawErrors> law;   ///< Errors of a known law that computed the torques of this step.
  double spectral_radius = kNaN;  ///< That of the law's sampled closed loop; NaN without error dynamics.
  /// LawErrors::position_by_hold, orientation_by_hold of the last step whose law was judged.
  std::pair<double, double> by_hold;
  WorstPart deepest_overlap;  ///< Clearance::FindDeepest, for bodies that must not touch.
  StepFindings findings;      ///< For the step's record.

  /// Terms at the true state.
  [[nodiscard]] const ModelTerms& terms() const { return declared->model->robot(); }
  [[nodiscard]] const GraspTerms& grasp() const { return declared->model->grasp(); }
};

/// Forms the analysis of each step. Nothing allocates after construction, except where a task's set of
/// contacts comes up for the first time.
///
/// For a task, each step is predicted with the contacts that it has: (46) for the fingertips that touch, and
/// an object that does not move while it lies on something.
class StepAnalyzer {
 public:
  explicit StepAnalyzer(const Setup& setup);

  /// Begins the next step, whose torques are set: measurements, and the clearance of bodies.
  void Begin(const StepRecord& step, const DeclaredStep& declared);
  /// Completes the analysis of the same step once its response was read: motion and forces.
  void Analyze();
  /// Sets the next step's torques, which may be refused.
  void SetStep(const StepRecord& step) { now_.step = &step; }
  void SetSpectralRadius(double radius) { now_.spectral_radius = radius; }
  /// Sets the errors of the same step's law.
  void SetLaw(const LawErrors& errors);
  /// Forgets all steps so far, but for clearances: time begins anew.
  void Reset();
  void RestartClearance() { clearance_.Restart(); }
  /// Analysis of the last step.
  [[nodiscard]] const StepAnalysis& analysis() const { return now_; }

  // Terms that the last step's analysis was formed with.
  /// M_bar' = L^T L, of the last prediction.
  [[nodiscard]] const TreeFactor& mass_factor() const { return *mass_factor_; }
  [[nodiscard]] const Clearance& clearance() const { return clearance_; }
  /// Null for a plant that is not the engine's.
  [[nodiscard]] const WholeRobot* whole() const { return whole_.get(); }
  /// The law of the engine's constraints; null where ConstraintLaw does not apply.
  [[nodiscard]] const ConstraintLaw* constraint_law() const { return constraint_law_.get(); }

 private:
  /// Contacts of a task, and how the rigid system behaves with them.
  struct PartialDynamics {
    PartialDynamics(const Setup& setup, ContactSet set);
    PartialGrasp grasp;
    ConstrainedDynamics dynamics;
  };
  void MeasureClearance();
  void FindContacts();
  void FindTouching();
  void CalcRolling();
  /// Calculates J_dot qvel of the plant's constraints at the fingertips (3N), or the feet, m/s^2: the w x v
  /// of object and platform, which the model's rates have along axes that turn and the engine's have not.
  void CalcContactBias();
  /// E_bar' tau' + pushes that are declared + dry friction and joint limits (n).
  void CalcAppliedForce();
  void Predict();
  void PredictPart();
  void CalcRobotResidual();
  void CalcWholeResidual();
  /// Sets MotionBalance of a plant that is not the engine's.
  void SetRigidMotion();
  void ComparePrediction();
  void CalcObjectResidual();
  void FindFeet();
  /// Returns the largest use of the friction cone over the bodies that stand. Each contact is weighted with
  /// its slip, since a contact that bears almost nothing may slide where the body does not.
  [[nodiscard]] double CalcFootUse() const;
  void PredictStance();
  void FollowSlip();
  void ForgetSlip();
  void MoveWindow();
  /// |f|_M^-1 = |L^-T f|
  [[nodiscard]] double Norm(const VectorXd& force) { return mass_factor_->CalcForceNorm(force, &norm_work_); }
  [[nodiscard]] double CalcWeight() const;  // of the object, N
  /// Whether anything but fingertips touches the object.
  [[nodiscard]] bool IsSupported() const { return !now_.step->response.support_wrench.isZero(0.0); }
  void KeepPrediction(const Prediction& prediction, const TreeFactor& factor);

  const Setup* setup_;
  double time_step_;
  double mass_;  // of the robot, kg
  StepAnalysis now_;
  const TreeFactor* mass_factor_ = nullptr;
  VectorXd contact_bias_, applied_force_, bias_;  // 3N; n; n, C_bar' xi + F_bar'
  Clearance clearance_;
  MjDataPtr kinematics_;  // of a plant that has no bodies of the engine's
  ActuationMap actuation_;
  ConstrainedDynamics dynamics_;
  std::unique_ptr<WholeRobot> whole_;  // null for a plant that is not the engine's
  std::unique_ptr<ConstraintLaw> constraint_law_;
  std::unique_ptr<VelocityMap> rolling_;                                       // as whole_
  VectorXd nu_dot_, whole_residual_, whole_size_, whole_left_, whole_pushed_;  // of nu
  VectorXd engine_force_, solver_force_, joint_force_;                         // nv, n, n
  Vector6d object_left_ = Vector6d::Zero();
  std::unique_ptr<GroundContacts> ground_;  // null for a robot that does not stand
  std::unique_ptr<GroundDynamics> ground_dynamics_;
  std::map<ContactSet, std::unique_ptr<PartialDynamics>> parts_;
  bool was_holding_ = false;  // at the step before
  long steps_ = 0;
  VectorXd acceleration_;  // n, work
  VectorXd least_;         // n, RoundingScales::CalcLeastForces
  VectorXd norm_work_;
};

}  // namespace dexcheck
