#pragma once

// The checks of questions two to four: one entry says all that is fixed about a check. StepChecks measures
// them, attribution reads what their failure means, and summary, log and report take names and bounds from
// the records that are made of the entries.

#include <string_view>

#include "harness/base/check_record.h"
#include "harness/checks/failure_cause.h"

namespace dexcheck {

/// In the order of log and summary.
enum class StepCheck {
  kGains,
  kTold,
  kLawTorque,
  kLawDemand,
  kGraspForce,
  kTorqueApplied,
  kErrorDynamics,
  kOrientationDynamics,
  kExpectPosition,
  kExpectOrientation,
  kJointDynamics,
  kExpectJoints,
  kBalanceRobot,
  kBalanceObject,
  kReducedAcceleration,
  kContactForce,
  kFingertipSlip,
  kFingertipSlipRate,
  kWheelSlip,
  kWheelSlipRate,
  kRolling,
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
  kCount
};
inline constexpr int kStepCheckCount = static_cast<int>(StepCheck::kCount);

/// How long balance and prediction are not judged after a contact has come, gone or been let go: soft
/// contacts need some milliseconds to become what rigid ones are at once. s.
inline constexpr double kTransient = 0.05;

// Contacts hold by soft constraints, so a fingertip that sticks still creeps. Along a tangent the engine lets
//
//   v_dot = -b v - R f_t + J_dot qvel,   hence after some 1/b   v = (J_dot qvel - R f_t) / b,
//
// with b = 2 / (tc d) = 1 / (d dt) of the time constant tc = 2 dt and the impedance d, and R = (1 - d) / (d m
// impratio) of the mass m that the contact moves. J_dot qvel is what (46) has and the engine's constraint has
// not: the model's J_B_dot' xi - G_dot^T V_Bo. So distances grow with time, at rates that do not: distances
// are judged over the last kSlipWindow at most, and the rates besides:
//
//   fingertip_slip_rate   |v| - dt |J_B_dot' xi - G_dot^T V_Bo| <= (1 - d) dt / impratio * kTipLoad,
//                         of d = 0.99, impratio = 100, whatever the plant has: 2e-5 m/s at 1 ms
//   wheel_slip_rate       |v| <= dt * kSideways: tyres give by v w / b in a curve; 1e-4 m/s at 1 ms
//
// Up to kSlipWindow after the start the windows begin there. Joints that do not carry the object are held by
// stiffness: what moves them does not add up.

// When the forces change by a step, soft contacts first give: the engine lets J qacc = a_ref - R f with R =
// (1 - d) / d times its estimate of what the contact moves, so about (1 - d) / d of the change is missing at
// first and comes back within some of the contact's time constants, critically damped. At the start of
// `offset` it is all of the residual: 1.33e-2, 1.33e-3, 1.33e-4 at d = 0.9, 0.99, 0.999, which is 5.5 (1 - d)
// / d of the change of E_bar' tau' (the estimate for a wheel that carries the robot is that much too large).
// kGive times (1 - d) / d is taken off the residuals.
inline constexpr double kGive = 8.0;

/// Distances are judged from a place between half of this and this ago, s.
inline constexpr double kSlipWindow = 10.0;
/// f_t / m up to which a fingertip may creep, m/s^2: 10 N on a phalanx of 50 g. `hold` has 6.
inline constexpr double kTipLoad = 200.0;
/// Its creep over the time step, m/s^2, with the shipped plant's impedance and impratio.
inline constexpr double kTipCreep = (1.0 - 0.99) / 100.0 * kTipLoad;
/// Acceleration v w in a curve up to which tyres may give, m/s^2. `curve` has 0.03.
inline constexpr double kSideways = 0.1;
// Bounds of the law. The engine's terms agree with the model's to some 1e-15 of their scales; the
// pseudoinverses of (47), (49) multiply that by the condition number, which is divided out, and are formed
// from Gram matrices, which have its square. Measured 6e-16 in `curve`, on a condition number of some tens.
inline constexpr double kLawTorqueBound = 1e-12;
// Where contacts slip, (47) plans for xi_c and the rigid system starts from xi: C_bar' (xi - xi_c) and
// J_dot (xi - xi_c) stay, slip speeds of some 1e-6 m/s against rates of the order of 1/s: measured 8e-10 in
// `curve`.
inline constexpr double kLawDemandBound = 1e-8;
// Slope of the grasp-force objective, relative: ten times the tolerance of the solver's slacks.
inline constexpr double kGraspForceBound = 1e-4;
// A torque goes through the gear's ratio once and back: two roundings.
inline constexpr double kTorqueAppliedBound = 1e-14;
// A wheel that rolls and does not slip has the speed of the platform above it, but for how fast the platform
// tilts or sinks on soft tyres: its tilt of at most 1e-5 rad within some ms, at an arm of r. Softer tyres
// sink farther: the bound is a multiple of this as their sinking is of the shipped plant's.
inline constexpr double kRollingBound = 1e-5;
// What is left of (48) is compared less the inertia of what the platform does on soft tyres besides rolling,
// less what the solver left over, and less what tilt and slip can come to (StepChecks::CalcUnevenForce). Then
// all of it is rounding of the engine's terms, 1e-14 of forces that cancel, and products of small departures:
// 1e-5 rad of tilt times 1e-2 of the forces that change with it.
inline constexpr double kBalanceRobotBound = 1e-6;
// What law_demand leaves, over K_p: measured 1.2e-9 m in `curve`.
inline constexpr double kErrorDynamicsBound = 1e-8;
inline constexpr double kOrientationDynamicsBound = 1e-7;
// Rounding of torques, over the least inertia that they drive and over K_p: measured 1e-14 for the Panda.
inline constexpr double kJointDynamicsBound = 1e-11;

/// What explains what: of the failed checks, those of the first of these ranks tell why, however late they
/// failed.
enum class Rank {
  kTold,           ///< Whoever is told wrongly does what is wrong.
  kLaw,            ///< Torques that are not the law's, or gains that cannot settle.
  kActuator,       ///< Torques that did not arrive.
  kObjectBalance,  ///< A force on the object that neither side has.
  /// A limit, a stop, a contact that slides: from then on everything else is void. So it is from a force on
  /// the robot on that neither side has, and with wheels that do not roll as they should; what came first
  /// tells.
  kDecisive,
  kAssumption,  ///< Contacts that give, a platform that tilts, a solver that stopped early.
  /// By algebra the prediction differs from the engine's motion by what the balances leave and by how the
  /// contacts give, J_B' xi_dot + J_B_dot' xi - d/dt(G^T V_o): where the balances hold, contacts gave.
  kPrediction,
  kResidual,  ///< Nothing else failed.
};

/// What the failure of a check says of its cause.
struct FailureMeaning {
  Cause cause = Cause::kNone;  ///< kNone: nothing by itself, it follows from the cause of the run.
  /// Of checks that failed at one time, the one with the smallest number tells the run's cause.
  int precedence = 0;
  /// Whether the failure has this cause whatever else happened in the run; otherwise it has the run's.
  bool is_own = false;
  /// When this check failed too, its cause holds for both.
  StepCheck sharper = StepCheck::kCount;
  Rank rank = Rank::kAssumption;
};

/// One entry.
struct StepCheckInfo {
  StepCheck check;
  const char* name;
  CheckKind kind;
  const char* unit;
  double bound;
  const char* description;
  FailureMeaning meaning = {};
  /// The same for fingertips that hang on bonds; empty where that question has no meaning.
  const char* bonded_description = description;
};

inline constexpr StepCheckInfo kStepChecks[] = {
    // Asked once, before anything moves. A radius of 1 never settles; so near to it an error takes 1e9 steps.
    {.check = StepCheck::kGains,
     .name = "gain_stability",
     .kind = CheckKind::kLaw,
     .unit = "1",
     .bound = 1.0 - 1e-9,
     .description = "largest eigenvalue of (57) with the scenario's gains, sampled as the controller does it",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 14, .is_own = true, .rank = Rank::kLaw}},
    {.check = StepCheck::kTold,
     .name = "told",
     .kind = CheckKind::kLaw,
     .unit = "1",
     .bound = 0.0,
     .description =
         "what the controller is told of the state against what is so, beyond what the scenario asks for",
     .meaning = {.cause = Cause::kSensing, .precedence = 15, .is_own = true, .rank = Rank::kTold}},
    {.check = StepCheck::kLawTorque,
     .name = "law_torque",
     .kind = CheckKind::kLaw,
     .unit = "1",
     .bound = kLawTorqueBound,
     .description =
         "tau' sent against (53)-(55) computed from the engine's terms, relative to the forces balanced and "
         "to the condition number of J_B'",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 16, .is_own = true, .rank = Rank::kLaw}},
    {.check = StepCheck::kLawDemand,
     .name = "law_demand",
     .kind = CheckKind::kLaw,
     .unit = "1",
     .bound = kLawDemandBound,
     .description = "accelerations and contact forces of the rigid system (46), (48) under tau' against "
                    "those that (47), "
                    "(49), (55) demand, likewise",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 17, .is_own = true, .rank = Rank::kLaw}},
    {.check = StepCheck::kGraspForce,
     .name = "grasp_force",
     .kind = CheckKind::kLaw,
     .unit = "1",
     .bound = kGraspForceBound,
     .description = "F_N by its certificate: in null(G), in the cones, optimal; each over its tolerance",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 18, .is_own = true, .rank = Rank::kLaw}},
    {.check = StepCheck::kTorqueApplied,
     .name = "torque_applied",
     .kind = CheckKind::kLaw,
     .unit = "1",
     .bound = kTorqueAppliedBound,
     .description = "torques that the joints received against those that were sent, relative to the largest",
     .meaning = {.cause = Cause::kActuator, .precedence = 19, .is_own = true, .rank = Rank::kActuator}},
    {.check = StepCheck::kErrorDynamics,
     .name = "error_dynamics",
     .kind = CheckKind::kLaw,
     .unit = "m",
     .bound = kErrorDynamicsBound,
     .description =
         "object's position against (57) integrated beside the run, driven by the accelerations that the "
         "prediction missed",
     .meaning = {.cause = Cause::kUnexplained, .precedence = 20, .rank = Rank::kResidual}},
    {.check = StepCheck::kOrientationDynamics,
     .name = "orientation_dynamics",
     .kind = CheckKind::kLaw,
     .unit = "rad",
     .bound = kOrientationDynamicsBound,
     .description = "object's orientation likewise",
     .meaning = {.cause = Cause::kUnexplained, .precedence = 28, .rank = Rank::kResidual}},
    {.check = StepCheck::kExpectPosition,
     .name = "expect_position",
     .kind = CheckKind::kLaw,
     .unit = "m",
     .bound = 0.0,
     .description = "object's position error, against what the scenario expects",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 21, .rank = Rank::kResidual}},
    {.check = StepCheck::kExpectOrientation,
     .name = "expect_orientation",
     .kind = CheckKind::kLaw,
     .unit = "rad",
     .bound = 0.0,
     .description = "object's orientation error, against what the scenario expects",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 22, .rank = Rank::kResidual}},
    {.check = StepCheck::kJointDynamics,
     .name = "joint_dynamics",
     .kind = CheckKind::kLaw,
     .unit = "rad",
     .bound = kJointDynamicsBound,
     .description = "joints against e_ddot + K_v e_dot + K_p e = 0 integrated beside the run, driven by the "
                    "accelerations that the prediction missed",
     .meaning = {.cause = Cause::kUnexplained, .precedence = 29, .rank = Rank::kResidual}},
    {.check = StepCheck::kExpectJoints,
     .name = "expect_joints",
     .kind = CheckKind::kLaw,
     .unit = "rad",
     .bound = 0.0,
     .description = "largest error of a joint (rad or m), against what the scenario expects",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 30, .rank = Rank::kResidual}},
    {.check = StepCheck::kBalanceRobot,
     .name = "balance_robot",
     .kind = CheckKind::kBalance,
     .unit = "1",
     .bound = kBalanceRobotBound,
     .description = "what is left of (48) with the engine's accelerations and contact forces, less what the "
                    "platform does besides and its solver left over, against the forces balanced",
     .meaning = {.cause = Cause::kUnmodelledForce, .precedence = -1, .rank = Rank::kDecisive}},
    // The object's balance has no other unknowns than its inertia and the contacts' geometry, which the first
    // question
    // compares: where that holds, a force acts on the object that nobody has.
    {.check = StepCheck::kBalanceObject,
     .name = "balance_object",
     .kind = CheckKind::kBalance,
     .unit = "1",
     .bound = 1e-9,
     .description = "what is left of (19) with the engine's acceleration and contact forces, less what its "
                    "solver left over, against the contact forces",
     .meaning = {.cause = Cause::kUnmodelledForce, .precedence = 24, .rank = Rank::kObjectBalance}},
    {.check = StepCheck::kReducedAcceleration,
     .name = "reduced_acceleration",
     .kind = CheckKind::kPrediction,
     .unit = "1",
     .bound = 1e-5,
     .description = "xi_dot of the rigid constrained system (46), (48) against the engine's",
     .meaning = {.cause = Cause::kContactSoftness, .precedence = 25, .rank = Rank::kPrediction}},
    {.check = StepCheck::kContactForce,
     .name = "contact_force",
     .kind = CheckKind::kPrediction,
     .unit = "1",
     .bound = 1e-6,
     .description = "f_c of the rigid constrained system against the engine's, relative to |f_c|",
     .meaning = {.cause = Cause::kContactSoftness, .precedence = 26, .rank = Rank::kPrediction}},
    // Slip and use of the cone tell sliding from contacts that merely give.
    {.check = StepCheck::kFingertipSlip,
     .name = "fingertip_slip",
     .kind = CheckKind::kAssumption,
     .unit = "m",
     .bound = 2e-4,
     .description = "how far a fingertip has slipped on the object in the last 5 to 10 s",
     .meaning =
         {.cause = Cause::kContactSoftness, .precedence = 6, .is_own = true, .sharper = StepCheck::kConeUse},
     .bonded_description = "distance of the joined points on fingertip and object"},
    {.check = StepCheck::kFingertipSlipRate,
     .name = "fingertip_slip_rate",
     .kind = CheckKind::kAssumption,
     .unit = "m/s",
     .bound = kTipCreep,  // times the time step
     .description =
         "how fast a fingertip slips on the object, less what (46) and the engine's constraint differ by",
     .meaning =
         {.cause = Cause::kContactSoftness, .precedence = 7, .is_own = true, .sharper = StepCheck::kConeUse},
     .bonded_description = ""},
    {.check = StepCheck::kWheelSlip,
     .name = "wheel_slip",
     .kind = CheckKind::kAssumption,
     .unit = "m",
     .bound = 1e-3,
     .description = "how far a wheel has slipped on the floor in the last 5 to 10 s, (1)",
     .meaning = {.cause = Cause::kContactSoftness,
                 .precedence = 8,
                 .is_own = true,
                 .sharper = StepCheck::kTractionUse}},
    {.check = StepCheck::kWheelSlipRate,
     .name = "wheel_slip_rate",
     .kind = CheckKind::kAssumption,
     .unit = "m/s",
     .bound = kSideways,  // times the time step
     .description = "how fast a wheel slips on the floor",
     .meaning = {.cause = Cause::kContactSoftness,
                 .precedence = 9,
                 .is_own = true,
                 .sharper = StepCheck::kTractionUse}},
    {.check = StepCheck::kRolling,
     .name = "rolling",
     .kind = CheckKind::kAssumption,
     .unit = "m/s",
     .bound = kRollingBound,
     .description = "speed of a wheel's rim against that of the platform above it, less its slip, (1)",
     .meaning = {.cause = Cause::kWheelGeometry, .precedence = 27, .is_own = true, .rank = Rank::kDecisive}},
    {.check = StepCheck::kConeUse,
     .name = "cone_use",
     .kind = CheckKind::kAssumption,
     .unit = "1",
     .bound = 0.99,
     .description = "tangential force over mu times normal force at a fingertip; 1 slides, (21)",
     .meaning = {.cause = Cause::kFingertipSlip, .precedence = 2, .is_own = true, .rank = Rank::kDecisive},
     .bonded_description = ""},
    {.check = StepCheck::kTractionUse,
     .name = "traction_use",
     .kind = CheckKind::kAssumption,
     .unit = "1",
     .bound = 0.99,
     .description = "tangential force over mu times normal force at a wheel; 1 spins or skids",
     .meaning = {.cause = Cause::kWheelSlip, .precedence = 3, .is_own = true, .rank = Rank::kDecisive}},
    {.check = StepCheck::kContactsLost,
     .name = "contacts_lost",
     .kind = CheckKind::kAssumption,
     .unit = "1",
     .bound = 0.0,
     .description = "fingertips that do not touch the object",
     .meaning = {.cause = Cause::kFingertipSlip, .precedence = 4, .is_own = true, .rank = Rank::kDecisive},
     .bonded_description = ""},
    {.check = StepCheck::kPenetration,
     .name = "penetration",
     .kind = CheckKind::kAssumption,
     .unit = "m",
     .bound = 2e-5,
     .description = "overlap of fingertip and object",
     .meaning = {.cause = Cause::kContactSoftness, .precedence = 5, .is_own = true},
     .bonded_description = ""},
    {.check = StepCheck::kKappa,
     .name = "kappa",
     .kind = CheckKind::kAssumption,
     .unit = "m",
     .bound = 2e-4,
     .description =
         "contact point on the object: kappa integrated by (40) over the last 5 to 10 s against the engine's",
     .meaning = {.cause = Cause::kContactSoftness, .precedence = 10},
     .bonded_description = ""},
    {.check = StepCheck::kBaseTilt,
     .name = "base_tilt",
     .kind = CheckKind::kAssumption,
     .unit = "rad",
     .bound = 1e-5,
     .description = "angle of the platform against the vertical",
     .meaning = {.cause = Cause::kTilt, .precedence = 13}},
    {.check = StepCheck::kIdleJoints,
     .name = "idle_joints",
     .kind = CheckKind::kAssumption,
     .unit = "rad",
     .bound = 1e-5,
     .description = "movement since t = 0 of joints that do not carry the object"},
    // As small as the discrepancies that the prediction is judged by. Forces that do not fit the motion
    // explain whatever
    // else is wrong from then on.
    {.check = StepCheck::kSolver,
     .name = "solver",
     .kind = CheckKind::kAssumption,
     .unit = "1",
     .bound = 1e-5,
     .description = "what the engine's solver left over of its own equations of motion, of the object as "
                    "balance_object, of the robot as balance_robot",
     .meaning = {.cause = Cause::kSolver, .precedence = -4, .is_own = true, .rank = Rank::kDecisive}},
    {.check = StepCheck::kJointStop,
     .name = "joint_stop",
     .kind = CheckKind::kAssumption,
     .unit = "rad",
     .bound = 0.0,
     .description = "how far a joint is beyond its range, where a stop pushes that the model does not have",
     .meaning = {.cause = Cause::kJointStop, .precedence = -2, .is_own = true, .rank = Rank::kDecisive}},
    // The fingers of one hand touch within some hundredths of a second, kTransient each at the most.
    {.check = StepCheck::kUnjudged,
     .name = "unjudged",
     .kind = CheckKind::kAssumption,
     .unit = "s",
     .bound = 5.0 * kTransient,
     .description = "how long in one go contacts have come and gone, so that balance and prediction were not "
                    "judged",
     .meaning = {.cause = Cause::kContactSoftness, .precedence = 11}},
    {.check = StepCheck::kActuators,
     .name = "actuator_effort",
     .kind = CheckKind::kAssumption,
     .unit = "1",
     .bound = 1.0,
     .description = "|tau'| over the motor's limit",
     .meaning = {.cause = Cause::kActuatorLimit, .precedence = -3, .is_own = true, .rank = Rank::kDecisive}},
};

static_assert([] {
  for (int i = 0; i < kStepCheckCount; ++i) {
    if (kStepChecks[i].check != static_cast<StepCheck>(i)) return false;
  }
  return std::size(kStepChecks) == static_cast<size_t>(kStepCheckCount);
}());

/// The entry of that name; null for checks of the first question.
constexpr const StepCheckInfo* FindStepCheck(std::string_view name) {
  for (const StepCheckInfo& info : kStepChecks) {
    if (info.name == name) return &info;
  }
  return nullptr;
}

}  // namespace dexcheck
