#pragma once

// Questions two to four of the cross-check, at every step of a run.
//
// Errors of forces and accelerations of the robot are measured in the metric of its own inertia, in which
// metres and radians, arms and phalanges weigh what they weigh: |a|_M = sqrt(a^T M_bar' a), |f|_M^-1 =
// sqrt(f^T M_bar'^-1 f), relative to |C_bar' xi + F_bar'|_M^-1, the force that the motors have to balance.

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "controller/control/actuation.h"
#include "controller/control/constrained_dynamics.h"
#include "controller/control/grasp_controller.h"
#include "controller/handling/partial_grasp.h"
#include "harness/checks/run_check.h"
#include "harness/plant/observer.h"
#include "harness/plant/plant.h"
#include "harness/simulation/setup.h"

namespace dexcheck {

/// What the engine did in one step, in the model's terms.
struct PlantMotion {
  VectorXd xi_dot;                       ///< n.
  Vector6d V_Bo_dot = Vector6d::Zero();  ///< Sigma_o.
  VectorXd f_c;                          ///< k, N, in each Sigma_cf.
};

/// Slip of one contact, from the engine's own velocities.
struct SlipState {
  bool touching = false;
  Vector3d velocity = Vector3d::Zero();  ///< Tangential, in the frame of the body that is slipped on, m/s.
  Vector3d distance = Vector3d::Zero();  ///< Its integral, m.
  /// The distance where the window begins that slip is judged over, and where the next one will.
  Vector3d window = Vector3d::Zero(), next_window = Vector3d::Zero();
  double cone_use = 0.0;     ///< |tangential force| / (mu normal force); 1 slides.
  double cone_margin = 0.0;  ///< mu normal force - |tangential force|, N.
};

/// What a step's contacts are meant to be.
struct Handling {
  bool partial = false;     ///< Contacts come and go, and the object may lie on something: a task.
  bool holding = true;      ///< All fingertips should touch the object.
  ContactSet contacts = 0;  ///< Of a task: fingertips that the law lets push.
};

/// Balance, prediction and assumptions. Nothing allocates after construction, except where a task's set of
/// contacts comes up for the first time.
///
/// Of a task each step is predicted with the contacts that it has: (46) for the fingertips that touch, and an
/// object that does not move while it lies on something. Soft contacts need some milliseconds to become what
/// rigid ones are at once: for kTransient after a contact has come, gone or been let go, balance and
/// prediction are not judged. How long that lasts in one go is a check itself.
///
/// Contacts hold by soft constraints, so a fingertip that sticks still creeps. Along a tangent the engine
/// lets
///
///   v_dot = -b v - R f_t + J_dot qvel,   hence after some 1/b   v = (J_dot qvel - R f_t) / b,
///
/// with b = 2 / (tc d) = 1 / (d dt) of the time constant tc = 2 dt and the impedance d, and R =
/// (1 - d) / (d m impratio) of the mass m that the contact moves. J_dot qvel is what (46) has and the
/// engine's constraint has not: the model's J_B_dot' xi - G_dot^T V_Bo. So distances grow with time, at rates
/// that do not: distances are judged over the last kWindow at most, and the rates besides:
///
///   fingertip_slip_rate   |v| - dt |J_B_dot' xi - G_dot^T V_Bo| <= (1 - d) dt / impratio * kTipLoad,
///                         of d = 0.99, impratio = 100, whatever the plant has: 2e-5 m/s at 1 ms
///   wheel_slip_rate       |v| <= dt * kSideways: tyres give by v w / b in a curve; 1e-4 m/s at 1 ms
///
/// Up to kWindow after the start the windows begin there. Joints that do not carry the object are held by
/// stiffness: what moves them does not add up.
class StepChecks {
 public:
  static constexpr double kTransient = 0.05;  ///< s
  /// Distances are judged from a place between half of this and this ago, s.
  static constexpr double kWindow = 10.0;
  /// f_t / m up to which a fingertip may creep, m/s^2: 10 N on a phalanx of 50 g. `hold` has 6.
  static constexpr double kTipLoad = 200.0;
  /// Acceleration v w in a curve up to which tyres may give, m/s^2. `curve` has 0.03.
  static constexpr double kSideways = 0.1;

  explicit StepChecks(const Setup& setup);

  /// Compares one step, after the plant's EndStep.
  /// @param state what the observer read before the step. @param tau that was applied (n).
  /// @param time at the beginning of the step, s.
  void Compare(const Plant& plant, const GraspController& controller, const MeasuredState& state,
               const Eigen::Ref<const VectorXd>& tau, Observer* observer, double time,
               const Handling& handling = {});

  /// Adds the largest |tau'| / limit of a motor: before the step, which does not come when that is above 1.
  void JudgeEffort(double effort, double time) { checks_[kActuators].Add(effort, time); }

  /// Forgets all steps so far: time begins anew.
  void Reset();

  [[nodiscard]] const std::vector<RunCheck>& checks() const { return checks_; }
  [[nodiscard]] const RunCheck& Find(std::string_view name) const;
  [[nodiscard]] const PlantMotion& engine() const { return engine_; }
  /// Of the last step that had one.
  [[nodiscard]] const Prediction& prediction() const { return *prediction_; }
  /// Upward force on the object by what it lies on at the last step, N.
  [[nodiscard]] double support_force() const { return support_force_; }
  /// Steps whose balance and prediction were not judged, because contacts had just changed.
  [[nodiscard]] long transient_steps() const { return transient_steps_; }
  [[nodiscard]] std::span<const EngineContact> contacts() const { return contacts_; }
  [[nodiscard]] const std::vector<SlipState>& fingertip_slip() const { return fingertip_slip_; }
  [[nodiscard]] const std::vector<SlipState>& wheel_slip() const { return wheel_slip_; }
  /// Least mu f_n - |f_t| of a fingertip so far, N.
  [[nodiscard]] double least_cone_margin() const { return least_cone_margin_; }
  /// Contacts of fingertips that broke so far.
  [[nodiscard]] long contacts_lost() const { return contacts_lost_; }

 private:
  enum Check {
    kBalanceRobot,
    kBalanceObject,
    kReducedAcceleration,
    kContactForce,
    kFingertipSlip,
    kFingertipSlipRate,
    kWheelSlip,
    kWheelSlipRate,
    kConeUse,
    kTractionUse,
    kContactsLost,
    kPenetration,
    kKappa,
    kBaseTilt,
    kIdleJoints,
    kSolver,
    kJointStop,
    kUnjudged,
    kActuators,
    kCheckCount
  };
  void Define(Check check, const char* name, CheckKind kind, const char* unit, double bound,
              const char* description);
  void Add(Check check, double value) { checks_[check].Add(value, time_); }
  /// Contacts of a task, and how the rigid system behaves with them.
  struct PartialDynamics {
    PartialDynamics(const Setup& setup, ContactSet set);
    PartialGrasp grasp;
    ConstrainedDynamics dynamics;
  };
  void FindContacts(const Handling& handling);
  void Predict(const GraspController& controller, const MeasuredState& state);
  void PredictPart(const GraspController& controller, const MeasuredState& state);
  void CompareDynamics(const GraspController& controller, const MeasuredState& state,
                       const Eigen::Ref<const VectorXd>& tau);
  void CompareObject(const GraspController& controller);
  /// Leaves out what this run cannot ask.
  void SetApplying();
  void ReadSlip(const Plant& plant, const GraspTerms& grasp, const MeasuredState& state);
  void MoveWindows(const MeasuredState& state, double dt);
  void ForgetSlip();
  /// Of the object, N.
  [[nodiscard]] double Weight() const;
  void CheckJointStops(const MeasuredState& state);
  void CompareKappa(const GraspController& controller, const MeasuredState& state, double dt);

  const Setup* setup_;
  std::vector<RunCheck> checks_;
  ConstrainedDynamics dynamics_;
  ActuationMap actuation_;
  PlantMotion engine_;
  const Prediction* prediction_ = nullptr;
  const TreeFactor* mass_factor_ = nullptr;
  std::map<ContactSet, std::unique_ptr<PartialDynamics>> parts_;
  Prediction part_prediction_;  // of a part of the contacts, spread over all
  Handling handling_;
  ContactSet touching_ = 0;
  bool supported_ = false;
  bool was_holding_ = false;
  double changed_at_ = -std::numeric_limits<double>::infinity();  // the contacts, s
  Vector6d support_ = Vector6d::Zero();                           // wrench on the object, Sigma_o
  Vector6d solver_residual_ = Vector6d::Zero();                   // likewise
  double support_force_ = 0.0;
  long transient_steps_ = 0;
  double unjudged_since_ = 0.0;  // s, while it lasts
  bool is_unjudged_ = false;
  std::span<const EngineContact> contacts_;
  std::vector<SlipState> fingertip_slip_, wheel_slip_;
  std::vector<int> wheel_bodies_, tip_bodies_;
  /// Integrated from (40) since the window's beginning, and since the next one's.
  std::vector<ContactCoordinates> kappa_, next_kappa_;
  VectorXd idle_start_;
  bool has_kappa_ = false;
  long steps_ = 0;
  long contacts_lost_ = 0;
  double least_cone_margin_ = std::numeric_limits<double>::infinity();
  double time_ = 0.0;
  VectorXd force_, bias_, residual_;  // n
  RowMatrixXd column_;                // n x 1
};

}  // namespace dexcheck
