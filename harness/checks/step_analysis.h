#pragma once

// What several checks share at a step: each quantity is computed once, and has one name.
//
// Errors of forces and accelerations of the robot are measured in the metric of its own inertia, in which
// metres and radians, arms and phalanges weigh what they weigh: |a|_M = sqrt(a^T M_bar' a), |f|_M^-1 =
// sqrt(f^T M_bar'^-1 f), relative to |C_bar' xi + F_bar'|_M^-1, the force that the motors have to balance.

#include <limits>
#include <map>
#include <memory>

#include "controller/control/actuation.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/handling/handling_controller.h"
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

/// Distances are judged from a place between half of this and this ago, s.
inline constexpr double kSlipWindow = 10.0;

/// The largest over the contacts of one kind.
struct SlipSummary {
  double distance = 0.0;  ///< Within the window, less creep, m; of bonds the distance of the joined points.
  double rate = 0.0;      ///< Less creep, m/s.
  double cone_use = 0.0;
};

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// What one step says of the law. Each is relative to what rounding, or the named tolerance, can explain.
/// Errors begin as NaN, so that a check of one that nobody set fails; allowances begin as 0.
struct LawErrors {
  /// |E_bar' (tau' - tau'_printed)| against the forces that the motors balance, both in the metric of the
  /// robot's inertia, over the condition number of J_B'.
  double torque = kNaN;
  /// xi_dot, V_o_dot and f_c of the rigid system (46), (48) under tau' against what (47), (49), (55) demand,
  /// likewise; forces relative to |f_c|. The largest of them.
  double demand = kNaN;
  /// The same with what contacts that slip make of it, and how much that is.
  double demand_residual = kNaN, demand_by_slip = 0.0;
  /// F_N by its certificate: the largest entry of G F_N, and how far f_c is outside its cones and bounds,
  /// both over max(1 N, |f_c|); the slope that the objective has left within null(G), over max(1, all of it).
  double grasp_null_space = kNaN, grasp_cone = kNaN, grasp_optimality = kNaN;
  /// Object's position, m, or largest distance of a joint, rad or m, against the error dynamics integrated
  /// from t = 0 and driven by the accelerations that the prediction missed.
  double error_dynamics = kNaN;
  double orientation_dynamics = kNaN;  ///< The object's orientation likewise, rad.
  /// How far from its desired pose the object would be if (57) alone drove it, m and rad: what the gains
  /// leave.
  double position_by_law = kNaN, orientation_by_law = kNaN;
  /// How far what the plant accelerates within a step, while torques and demand are held, leads away from
  /// (57), m and rad.
  double position_by_hold = 0.0, orientation_by_hold = 0.0;
};

/// One step; n entries of xi, 3N of f_c.
struct StepAnalysis {
  const Setup* setup = nullptr;
  const StepRecord* step = nullptr;
  const DeclaredStep* declared = nullptr;
  const ModelTerms* robot = nullptr;  ///< At the true state.
  const GraspTerms* grasp = nullptr;  ///< Likewise.

  // Contacts.
  ContactSet touching = 0;      ///< Fingertips that touch the object, or feet that bear something.
  bool is_supported = false;    ///< Whether anything else does.
  bool begins_holding = false;  ///< Whether all fingertips should touch the object from this step on.
  bool is_window_end = false;  ///< Whether the window that distances are judged over moves on after the step.
  int contacts_missing = 0;    ///< Fingertips that do not touch.
  double penetration = 0.0;    ///< Deepest overlap of a fingertip and the object, m.
  /// Distance of each fingertip that touches, by the plant less by the declared shapes (N), m; else 0.
  VectorXd contact_mismatch;
  /// J_dot qvel of the plant's constraints at the fingertips (3N), or the feet, m/s^2: the model's rates of
  /// velocities along axes that turn have w x v of object and platform, the engine's have not.
  VectorXd contact_bias;
  SlipSummary fingertips, wheels, feet;
  double foot_gap = 0.0;          ///< Largest gap of a foot of a robot that stands and the ground, m.
  double foot_penetration = 0.0;  ///< Deepest overlap of a foot and the ground, m.
  /// Largest difference of a foot's distance by the plant and by the declared shapes, m, and whose it is.
  std::pair<double, int> foot_mismatch;

  // Wheels.
  Vector2d wheel_rates = Vector2d::Zero();  ///< Of the right and left wheel against the ground, rad/s.
  /// v +- w b / 2 - r thetadot of the right and the left wheel, (1), m/s.
  Vector2d wheel_mismatch = Vector2d::Zero();
  Vector2d wheel_slip = Vector2d::Zero();  ///< What of that slipping and tyres that give may be, m/s.

  // Dynamics: (48) and (19) with the plant's accelerations and contact forces.
  VectorXd applied_force;  ///< E_bar' tau' + pushes that are declared + dry friction and joint limits (n).
  VectorXd bias;           ///< C_bar' xi + F_bar' (n).
  /// M_bar' = L^T L, of the last prediction; null before the first, and then nothing of the following is set.
  const TreeFactor* mass_factor = nullptr;
  double balanced = 1.0;              ///< |bias|_M^-1, at least that of RoundingScales::CalcLeastForces.
  VectorXd robot_residual;            ///< M_bar' xi_dot + bias + J_B'^T f_c - applied_force (n) of (48).
  double robot_residual_norm = kNaN;  ///< Of that, |.|_M^-1.
  /// The largest that is left of the equations of motion of the whole robot and its object (WholeRobot), over
  /// the sizes that it is the sum of, and which entry of nu it is.
  std::pair<double, int> whole_residual = {kNaN, -1};
  /// Its M, and its Coriolis forces, gravity and friction, against the engine's, likewise.
  std::pair<double, int> mass_error = {kNaN, -1}, bias_error = {kNaN, -1};
  const WholeRobot* whole = nullptr;  ///< Null for a plant that is not the engine's.
  /// ConstraintLaw::FindWorst.
  std::pair<double, int> constraint_force = {kNaN, -1};
  const ConstraintLaw* constraint_law = nullptr;  ///< Null where the engine has none that it keeps to.
  double robot_solver = kNaN;  ///< What the plant's solver left over for the robot, relative to `balanced`.
  Vector6d object_residual = Vector6d::Zero();  ///< M_hat V_o_dot + C_hat V_o + N_o - G f_c - ... of (19).
  double object_residual_size = kNaN;           ///< Relative, as forces at the contacts' arm.
  double object_solver = kNaN;                  ///< What the plant's solver left over, likewise.

  // What the rigid constrained system does under the same torques.
  /// |xi_dot_model - xi_dot|_M relative to |xi_dot_model|_M, or to `balanced` where that is more.
  double acceleration_error = kNaN;
  double contact_force_error = kNaN;  ///< |f_c_model - f_c|, relative.

  // Law, motors and sensors.
  double measurement_error =
      kNaN;                    ///< What was measured against what the declared sensing makes of the truth.
  double torque_error = kNaN;  ///< Largest torque received against the declared one, over the largest.
  const LawErrors* law = nullptr;  ///< Of torques that a known law computed at this step; null otherwise.
  double spectral_radius = kNaN;   ///< Of the law's sampled closed loop, where it has error dynamics.
  /// LawErrors, of the last step whose law was judged.
  double position_by_hold = 0.0, orientation_by_hold = 0.0;

  // Bodies that are not meant to touch.
  const Clearance* clearance = nullptr;
  std::pair<double, int> deepest_overlap;  ///< Clearance::FindDeepest.

  StepFindings findings;  ///< For the step's record.
};

/// Forms the analysis of each step. Nothing allocates after construction, except where a task's set of
/// contacts comes up for the first time.
///
/// For a task, each step is predicted with the contacts that it has: (46) for the fingertips that touch, and
/// an object that does not move while it lies on something.
class StepAnalyzer {
 public:
  explicit StepAnalyzer(const Setup& setup);

  /// The next step, whose torques are set: measurements, and the clearance of bodies.
  void Begin(const StepRecord& step, const DeclaredStep& declared);
  /// The same step, whose response was read: motion and forces.
  void Analyze();
  /// The next step's torques, which may be refused.
  void SetStep(const StepRecord& step) { now_.step = &step; }
  void SetSpectralRadius(double radius) { now_.spectral_radius = radius; }
  /// Keeps what was found of the same step's law.
  void SetLaw(const LawErrors* errors);
  /// Forgets all steps so far, but for clearances: time begins anew.
  void Reset();
  void RestartClearance() { clearance_.Restart(); }
  /// Of the last step.
  [[nodiscard]] const StepAnalysis& analysis() const { return now_; }

 private:
  /// Contacts of a task, and how the rigid system behaves with them.
  struct PartialDynamics {
    PartialDynamics(const Setup& setup, ContactSet set);
    PartialGrasp grasp;
    ConstrainedDynamics dynamics;
  };
  void CompareMeasurement();
  void MeasureClearance();
  void CompareMotors();
  void FindContacts();
  void FindTouching();
  void CalcRolling();
  void CalcContactBias();
  void CalcAppliedForce();
  void Predict();
  void PredictPart();
  void CalcRobotResidual();
  void CalcWholeResidual();
  void ComparePrediction();
  void CalcObjectResidual();
  void FindFeet();
  /// The largest, over the bodies that stand, of the friction at their contacts over the most that it can be,
  /// each contact weighed with its slip: one that bears next to nothing may slide where the body does not.
  [[nodiscard]] double CalcFootUse() const;
  void PredictStance();
  void FollowSlip();
  void ForgetSlip();
  void MoveWindow();
  /// |f|_M^-1 = |L^-T f|
  [[nodiscard]] double Norm(const VectorXd& force) {
    return now_.mass_factor->CalcForceNorm(force, &norm_work_);
  }
  [[nodiscard]] double CalcWeight() const;  // of the object, N

  const Setup* setup_;
  double time_step_;
  double mass_;  // of the robot, kg
  StepAnalysis now_;
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
  VectorXd acceleration_;  // n
  VectorXd least_;         // n, RoundingScales::CalcLeastForces
  VectorXd norm_work_;
};

}  // namespace dexcheck
