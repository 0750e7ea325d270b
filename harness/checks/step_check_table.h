#pragma once

// The checks of questions two to four: one entry says all that is fixed about a check. StepChecks measures
// them, attribution reads what their failure means, and summary, log and report take names and bounds from
// the records that are made of the entries.

#include <string_view>

#include "harness/base/check_record.h"
#include "harness/checks/failure_cause.h"
#include "harness/checks/step_bounds.h"

namespace dexcheck {

/// In the order of log and summary.
enum class StepCheck {
  kSpectralRadius,
  kMeasurement,
  kLawTorque,
  kLawDemand,
  kGraspNullSpace,
  kGraspCone,
  kGraspOptimality,
  kTorqueApplied,
  kErrorDynamics,
  kOrientationDynamics,
  kExpectPosition,
  kExpectOrientation,
  kJointDynamics,
  kExpectJoints,
  kInverseDynamicsRobot,
  kInverseDynamicsObject,
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
  kFingertipRim,
  kBaseTilt,
  kIdleJoints,
  kSolver,
  kJointLimit,
  kClearance,
  kCollision,
  kExcluded,
  kActuators,
  kCount
};
inline constexpr int kStepCheckCount = static_cast<int>(StepCheck::kCount);

/// How long balance and prediction are not judged after a contact has come, gone or been let go: soft
/// contacts need some milliseconds to become what rigid ones are at once. s.
inline constexpr double kTransient = 0.05;

/// What explains what: of the failed checks, those of the first of these ranks tell why, however late they
/// failed.
enum class Rank {
  kMeasurement,    ///< Whoever is told wrongly does what is wrong.
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
  CheckCategory kind;
  const char* unit;
  /// Compares model and engine relative to their own size: ten times a scenario's tolerance hold where that
  /// is wider.
  bool is_relative = false;
  double bound;  ///< With the shipped plant and gains.
  Scaling scaling = Scaling::kNone;
  const char* formula = "";  ///< Of the bound, and why it is that; the table in README.md.
  const char* reason = "";
  const char* description = "";
  FailureMeaning meaning = {};
  /// The same for fingertips that hang on bonds; empty where that question has no meaning.
  const char* bonded_description = description;
  /// The same for a robot that holds nothing, whose law is that of its joints.
  const char* joint_description = description;
};

inline constexpr StepCheckInfo kStepChecks[] = {
    // Asked once, before anything moves. A radius of 1 never settles; so near to it an error takes 1e9 steps.
    {.check = StepCheck::kSpectralRadius,
     .name = "closed_loop_spectral_radius",
     .kind = CheckCategory::kLaw,
     .unit = "1",
     .bound = 1.0 - 1e-9,
     .formula = "1 - 1e-9",
     .reason = "an error that settles within 1e9 steps",
     .description = "largest eigenvalue of (57) with the scenario's gains, sampled as the controller does it",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 14, .is_own = true, .rank = Rank::kLaw},
     .joint_description =
         "largest eigenvalue of the errors of the joints under the scenario's gains, sampled as "
         "the controller does it"},
    {.check = StepCheck::kMeasurement,
     .name = "measurement",
     .kind = CheckCategory::kLaw,
     .unit = "1",
     .bound = 0.0,
     .formula = "0",
     .reason = "copied, or computed twice from the same numbers",
     .description =
         "what the controller is told of the state against what is so, beyond what the scenario asks for",
     .meaning = {.cause = Cause::kSensing, .precedence = 15, .is_own = true, .rank = Rank::kMeasurement}},
    {.check = StepCheck::kLawTorque,
     .name = "law_torque",
     .kind = CheckCategory::kLaw,
     .unit = "1",
     .is_relative = true,
     .bound = kLawTorqueBound,
     .formula = "1e-12",
     .reason = "rounding of the terms, 1e-15, through Gram matrices of condition number^2; the condition "
               "number is divided out",
     .description =
         "tau' sent against (53)-(55) computed from the engine's terms, relative to the forces balanced and "
         "to the condition number of J_B'",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 16, .is_own = true, .rank = Rank::kLaw},
     .joint_description =
         "torques sent against the law of the joints computed from the engine's terms, relative "
         "to the forces balanced"},
    {.check = StepCheck::kLawDemand,
     .name = "law_demand",
     .kind = CheckCategory::kLaw,
     .unit = "1",
     .is_relative = true,
     .bound = kLawDemandBound,
     .formula = "1e-8 + 10 slip forces",
     .reason = "C_bar' (xi - xi_c) and M_bar' J^+ J_dot (xi - xi_c), which slip makes, are taken off",
     .description = "accelerations and contact forces of the rigid system (46), (48) under tau' against "
                    "those that (47), "
                    "(49), (55) demand, likewise",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 17, .is_own = true, .rank = Rank::kLaw}},
    {.check = StepCheck::kGraspNullSpace,
     .name = "grasp_null_space",
     .kind = CheckCategory::kLaw,
     .unit = "1",
     .bound = kGraspNullBound,
     .formula = "1e-9",
     .reason = "F_N = f_c - G^+ F_o has the solver's residual of f_c, 1e-10, and the rounding of G^+",
     .description = "largest entry of G F_N, N and N m, over |f_c| and 1 N",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 18, .is_own = true, .rank = Rank::kLaw}},
    {.check = StepCheck::kGraspCone,
     .name = "grasp_cone",
     .kind = CheckCategory::kLaw,
     .unit = "1",
     .bound = kGraspConeBound,
     .formula = "1e-9",
     .reason = "likewise: the solver's own f_c are inside",
     .description =
         "how far f_c = G^+ F_o + F_N is outside the friction cones, f_min and f_max, over |f_c| and "
         "1 N",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 32, .is_own = true, .rank = Rank::kLaw}},
    {.check = StepCheck::kGraspOptimality,
     .name = "grasp_optimality",
     .kind = CheckCategory::kLaw,
     .unit = "1",
     .bound = kGraspOptimalityBound,
     .formula = "10 slack_tolerance",
     .reason =
         "a barrier solution is optimal to the tolerance of the solver's slacks, 1e-5; near a cone's edge "
         "its slope follows with ten times that",
     .description =
         "slope of the grasp force's objective that is left within null(G), over the whole slope and "
         "1; where f_c is inside",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 33, .is_own = true, .rank = Rank::kLaw}},
    {.check = StepCheck::kTorqueApplied,
     .name = "torque_applied",
     .kind = CheckCategory::kLaw,
     .unit = "1",
     .bound = kTorqueAppliedBound,
     .formula = "1e-14",
     .reason = "a gear's ratio, once and back: two roundings",
     .description = "torques that the joints received against those that were sent, relative to the largest",
     .meaning = {.cause = Cause::kActuator, .precedence = 19, .is_own = true, .rank = Rank::kActuator}},
    {.check = StepCheck::kErrorDynamics,
     .name = "error_dynamics",
     .kind = CheckCategory::kLaw,
     .unit = "m",
     .bound = kErrorDynamicsBound,
     .scaling = Scaling::kPositionGain,
     .formula = "4e-6 m/s^2 / K_p",
     .reason = "what law_demand leaves is held by K_p alone",
     .description =
         "object's position against (57) integrated beside the run, driven by the accelerations that the "
         "prediction missed",
     .meaning = {.cause = Cause::kUnexplained, .precedence = 20, .rank = Rank::kResidual}},
    {.check = StepCheck::kOrientationDynamics,
     .name = "orientation_dynamics",
     .kind = CheckCategory::kLaw,
     .unit = "rad",
     .bound = kOrientationDynamicsBound,
     .scaling = Scaling::kOrientationGain,
     .formula = "4e-5 rad/s^2 / K_p",
     .reason = "likewise",
     .description = "object's orientation likewise",
     .meaning = {.cause = Cause::kUnexplained, .precedence = 28, .rank = Rank::kResidual}},
    {.check = StepCheck::kExpectPosition,
     .name = "expect_position",
     .kind = CheckCategory::kLaw,
     .unit = "m",
     .bound = 0.0,
     .formula = "[expect] position + hold",
     .reason =
         "what the scenario means; hold is where (57) is led by what a rigid plant accelerates within a "
         "step",
     .description = "object's position error, against what the scenario expects",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 21, .rank = Rank::kResidual}},
    {.check = StepCheck::kExpectOrientation,
     .name = "expect_orientation",
     .kind = CheckCategory::kLaw,
     .unit = "rad",
     .bound = 0.0,
     .formula = "[expect] orientation + hold",
     .reason = "likewise",
     .description = "object's orientation error, against what the scenario expects",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 22, .rank = Rank::kResidual}},
    {.check = StepCheck::kJointDynamics,
     .name = "joint_dynamics",
     .kind = CheckCategory::kLaw,
     .unit = "rad",
     .bound = kJointDynamicsBound,
     .formula = "1e-11",
     .reason = "rounding of torques, over the least inertia that they drive and over K_p",
     .description = "joints against e_ddot + K_v e_dot + K_p e = 0 integrated beside the run, driven by the "
                    "accelerations that the prediction missed",
     .meaning = {.cause = Cause::kUnexplained, .precedence = 29, .rank = Rank::kResidual}},
    {.check = StepCheck::kExpectJoints,
     .name = "expect_joints",
     .kind = CheckCategory::kLaw,
     .unit = "rad",
     .bound = 0.0,
     .formula = "[expect] joints",
     .reason = "what the scenario means",
     .description = "largest error of a joint (rad or m), against what the scenario expects",
     .meaning = {.cause = Cause::kControlLaw, .precedence = 30, .rank = Rank::kResidual}},
    {.check = StepCheck::kInverseDynamicsRobot,
     .name = "inverse_dynamics_robot",
     .kind = CheckCategory::kInverseDynamics,
     .unit = "1",
     .is_relative = true,
     .bound = kInverseDynamicsRobotBound,
     .formula = "1e-6 + (g tilt + 2 slip w) sqrt(m) + f_t r_sunk / (2 r) + 2 tilt_rate sqrt(2 E)",
     .reason = "rounding of forces that cancel; the state that is judged is level and does not slip",
     .description = "what is left of (48) with the engine's accelerations and contact forces, less what the "
                    "platform does besides and its solver left over, against the forces balanced",
     .meaning = {.cause = Cause::kUnmodelledForce, .precedence = -1, .rank = Rank::kDecisive},
     .joint_description =
         "what is left of the equations of motion with the engine's accelerations, against the "
         "forces balanced"},
    // The object's balance has no other unknowns than its inertia and the contacts' geometry, which the first
    // question compares: where that holds, a force acts on the object that nobody has.
    {.check = StepCheck::kInverseDynamicsObject,
     .name = "inverse_dynamics_object",
     .kind = CheckCategory::kInverseDynamics,
     .unit = "1",
     .is_relative = true,
     .bound = 1e-9,
     .formula = "1e-9",
     .reason = "rounding of the object's terms",
     .description = "what is left of (19) with the engine's acceleration and contact forces, less what its "
                    "solver left over, against the contact forces",
     .meaning = {.cause = Cause::kUnmodelledForce, .precedence = 24, .rank = Rank::kObjectBalance}},
    {.check = StepCheck::kReducedAcceleration,
     .name = "reduced_acceleration",
     .kind = CheckCategory::kForwardDynamics,
     .unit = "1",
     .is_relative = true,
     .bound = 1e-6,
     .formula = "1e-6 + give",
     .reason = "what contacts hold back of forces that change, computed at each step; the rest is of second "
               "order in tilt and slip",
     .description = "xi_dot of the rigid constrained system (46), (48) against the engine's",
     .meaning = {.cause = Cause::kContactSoftness, .precedence = 25, .rank = Rank::kPrediction},
     .joint_description = "accelerations of the joints that the torques mean, against the engine's"},
    {.check = StepCheck::kContactForce,
     .name = "contact_force",
     .kind = CheckCategory::kForwardDynamics,
     .unit = "1",
     .is_relative = true,
     .bound = 1e-7,
     .formula = "1e-7 + give",
     .reason = "likewise",
     .description = "f_c of the rigid constrained system against the engine's, relative to |f_c|",
     .meaning = {.cause = Cause::kContactSoftness, .precedence = 26, .rank = Rank::kPrediction}},
    // Slip and use of the cone tell sliding from contacts that merely give.
    {.check = StepCheck::kFingertipSlip,
     .name = "fingertip_slip",
     .kind = CheckCategory::kAssumption,
     .unit = "m",
     .bound = kSlipWindow * kShippedCreep,
     .scaling = Scaling::kCreep,
     .formula = "10 s (1 - d) dt 2 m/s^2",
     .reason = "the rate below, over the window, less the same",
     .description = "how far a fingertip has slipped on the object in the last 5 to 10 s",
     .meaning =
         {.cause = Cause::kContactSoftness, .precedence = 6, .is_own = true, .sharper = StepCheck::kConeUse},
     .bonded_description = "distance of the joined points on fingertip and object"},
    {.check = StepCheck::kFingertipSlipRate,
     .name = "fingertip_slip_rate",
     .kind = CheckCategory::kAssumption,
     .unit = "m/s",
     .bound = kShippedCreep,
     .scaling = Scaling::kCreep,
     .formula = "(1 - d) dt 2 m/s^2",
     .reason = "besides dt J_dot qvel, which is known and taken off: creep of a contact that sticks under "
               "f_t / m of 200 m/s^2, over an impratio of 100",
     .description =
         "how fast a fingertip slips on the object, less what (46) and the engine's constraint differ by",
     .meaning =
         {.cause = Cause::kContactSoftness, .precedence = 7, .is_own = true, .sharper = StepCheck::kConeUse},
     .bonded_description = ""},
    {.check = StepCheck::kWheelSlip,
     .name = "wheel_slip",
     .kind = CheckCategory::kAssumption,
     .unit = "m",
     .bound = kSlipWindow * kShippedLag,
     .scaling = Scaling::kLag,
     .formula = "10 s dt 0.1 m/s^2",
     .reason = "the rate below, over the window",
     .description = "how far a wheel has slipped on the floor in the last 5 to 10 s, (1)",
     .meaning = {.cause = Cause::kContactSoftness,
                 .precedence = 8,
                 .is_own = true,
                 .sharper = StepCheck::kTractionUse}},
    {.check = StepCheck::kWheelSlipRate,
     .name = "wheel_slip_rate",
     .kind = CheckCategory::kAssumption,
     .unit = "m/s",
     .bound = kShippedLag,
     .scaling = Scaling::kLag,
     .formula = "dt 0.1 m/s^2",
     .reason = "tyres give sideways by v w / b, of v w up to 0.1 m/s^2",
     .description = "how fast a wheel slips on the floor",
     .meaning = {.cause = Cause::kContactSoftness,
                 .precedence = 9,
                 .is_own = true,
                 .sharper = StepCheck::kTractionUse}},
    {.check = StepCheck::kRolling,
     .name = "rolling",
     .kind = CheckCategory::kAssumption,
     .unit = "m/s",
     .bound = kShippedSoftness * kShippedTimeConstant * kRollLoad,
     .scaling = Scaling::kSinkingRate,
     .formula = "(1 - d) tc 0.5 m/s^2 + slip + sinking",
     .reason =
         "a platform that sinks or tilts on soft tyres; how fast it does under changing torques is computed",
     .description = "speed of a wheel's rim against that of the platform above it, less its slip, (1)",
     .meaning = {.cause = Cause::kWheelGeometry, .precedence = 27, .is_own = true, .rank = Rank::kDecisive}},
    {.check = StepCheck::kConeUse,
     .name = "cone_use",
     .kind = CheckCategory::kAssumption,
     .unit = "1",
     .bound = 0.99,
     .formula = "0.99",
     .reason = "1 slides",
     .description = "tangential force over mu times normal force at a fingertip; 1 slides, (21)",
     .meaning = {.cause = Cause::kFingertipSlip, .precedence = 2, .is_own = true, .rank = Rank::kDecisive},
     .bonded_description = ""},
    {.check = StepCheck::kTractionUse,
     .name = "traction_use",
     .kind = CheckCategory::kAssumption,
     .unit = "1",
     .bound = 0.99,
     .formula = "0.99",
     .reason = "1 slides",
     .description = "tangential force over mu times normal force at a wheel; 1 spins or skids",
     .meaning = {.cause = Cause::kWheelSlip, .precedence = 3, .is_own = true, .rank = Rank::kDecisive}},
    {.check = StepCheck::kContactsLost,
     .name = "contacts_lost",
     .kind = CheckCategory::kAssumption,
     .unit = "1",
     .bound = 0.0,
     .formula = "0",
     .reason = "none",
     .description = "fingertips that do not touch the object",
     .meaning = {.cause = Cause::kFingertipSlip, .precedence = 4, .is_own = true, .rank = Rank::kDecisive},
     .bonded_description = ""},
    {.check = StepCheck::kPenetration,
     .name = "penetration",
     .kind = CheckCategory::kAssumption,
     .unit = "m",
     .bound = kShippedSinking * kTipPress,
     .scaling = Scaling::kSinking,
     .formula = "4 (1 - d) dt^2 500 m/s^2",
     .reason = "the overlap at rest under f_n / m of 500 m/s^2",
     .description = "overlap of fingertip and object",
     .meaning = {.cause = Cause::kContactSoftness, .precedence = 5, .is_own = true},
     .bonded_description = ""},
    {.check = StepCheck::kKappa,
     .name = "kappa",
     .kind = CheckCategory::kAssumption,
     .unit = "m",
     .bound = kKappaBound,
     .scaling = Scaling::kSquaredStep,
     .formula = "0.1 m (10 rad/s dt)^2 / 12",
     .reason = "the trapezoidal rule, of contacts that roll 0.1 m within the window and turn at 10 rad/s",
     .description = "kappa integrated by (40) over the last 5 to 10 s, as fingertip and object moved, slip "
                    "included, against the engine's: points on object and fingertip, psi at its radius",
     .meaning = {.cause = Cause::kContactSoftness, .precedence = 10},
     .bonded_description = ""},
    // On the sphere that the plant has, contacts roll on; the paper's fingertip ends.
    {.check = StepCheck::kFingertipRim,
     .name = "fingertip_rim",
     .kind = CheckCategory::kAssumption,
     .unit = "m",
     .bound = 0.0,
     .formula = "0",
     .reason = "a hemisphere ends there",
     .description = "how far a contact is past the rim of its hemispherical fingertip",
     .meaning = {.cause = Cause::kFingertipRim, .precedence = -6, .is_own = true, .rank = Rank::kDecisive}},
    {.check = StepCheck::kBaseTilt,
     .name = "base_tilt",
     .kind = CheckCategory::kAssumption,
     .unit = "rad",
     .bound = kShippedSinking * kTiltLoad,
     .scaling = Scaling::kSinking,
     .formula = "4 (1 - d) dt^2 250 / s^2",
     .reason = "tyres that sink under loads of 100 m/s^2 at an arm of 0.4 m",
     .description = "angle of the platform against the vertical",
     .meaning = {.cause = Cause::kTilt, .precedence = 13}},
    {.check = StepCheck::kIdleJoints,
     .name = "idle_joints",
     .kind = CheckCategory::kAssumption,
     .unit = "rad",
     .bound = 1e-5,
     .scaling = Scaling::kPosture,
     .formula = "(1 - d) dt^2 1e5 rad/s^4 / omega_p^2",
     .reason = "what the posture task's stiffness leaves of accelerations that soft contacts make",
     .description = "movement since t = 0 of joints that do not carry the object"},
    // As small as the discrepancies that the prediction is judged by. Forces that do not fit the motion
    // explain whatever
    // else is wrong from then on.
    {.check = StepCheck::kSolver,
     .name = "solver",
     .kind = CheckCategory::kAssumption,
     .unit = "1",
     .bound = 1e-5,
     .formula = "1e-5",
     .reason = "as small as what the prediction is judged by",
     .description = "what the engine's solver left over of its own equations of motion, of the object as "
                    "inverse_dynamics_object, of the robot as inverse_dynamics_robot",
     .meaning = {.cause = Cause::kSolver, .precedence = -4, .is_own = true, .rank = Rank::kDecisive},
     .joint_description = "what the engine's solver left over of its own equations of motion"},
    {.check = StepCheck::kJointLimit,
     .name = "joint_limit",
     .kind = CheckCategory::kAssumption,
     .unit = "rad",
     .bound = kJointLimitBound,
     .formula = "1e-12",
     .reason = "a stop pushes; less is rounding",
     .description = "how far a joint is beyond its range, where a stop pushes that the model does not have",
     .meaning = {.cause = Cause::kJointLimit, .precedence = 1, .is_own = true, .rank = Rank::kDecisive}},
    {.check = StepCheck::kClearance,
     .name = "clearance",
     .kind = CheckCategory::kAssumption,
     .unit = "m",
     .bound = kClearanceBound,
     .formula = "1e-6",
     .reason = "the bodies' distances are known to 1e-7 m",
     .description = "how deep two bodies overlap that are not meant to touch",
     .meaning = {.cause = Cause::kCollision, .precedence = 12, .is_own = true}},
    {.check = StepCheck::kCollision,
     .name = "collision",
     .kind = CheckCategory::kAssumption,
     .unit = "N",
     .bound = 0.0,
     .formula = "0",
     .reason = "the model has no such contact",
     .description = "largest force between two bodies that are not meant to touch",
     .meaning = {.cause = Cause::kCollision, .precedence = -5, .is_own = true, .rank = Rank::kDecisive}},
    // The fingers of one hand touch within some hundredths of a second, kTransient each at the most.
    {.check = StepCheck::kExcluded,
     .name = "excluded",
     .kind = CheckCategory::kAssumption,
     .unit = "s",
     .bound = 5.0 * kTransient,
     .formula = "0.25 s",
     .reason = "five transients: the fingers of one hand touch within some hundredths of a second",
     .description = "how long in one go contacts have come and gone, so that the prediction was not judged",
     .meaning = {.cause = Cause::kContactSoftness, .precedence = 11}},
    {.check = StepCheck::kActuators,
     .name = "actuator_effort",
     .kind = CheckCategory::kAssumption,
     .unit = "1",
     .bound = 1.0,
     .formula = "1",
     .reason = "the motor's limit",
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
