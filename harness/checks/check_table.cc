#include "harness/checks/check_table.h"

#include <algorithm>
#include <limits>
#include <map>

#include "harness/base/worst.h"

namespace dexcheck {
namespace {

// Contacts hold by soft constraints of a time constant tc, two time steps dt unless the scenario says
// otherwise, and an impedance d. With b = 2 / (tc d), k = 1 / (d tc^2) and R = (1 - d) / (d m) of the mass m
// that the contact moves the engine lets
//
//   along a normal   r_ddot = -b r_dot - k r - R f_n
//                    at rest: r = -(1 - d) tc^2 f_n / m
//   along a tangent  v_dot = -b v - R f_t / impratio + J_dot qvel
//                    at rest: v = tc d / 2 J_dot qvel - (1 - d) tc / 2 / impratio f_t / m
//
// J_dot qvel is in (46) and not in the engine's constraint: at a fingertip it is the model's J_B_dot' xi -
// G_dot^T V_Bo, and the w x v of object and platform, whose velocities the model takes along axes that turn;
// at a tyre it is v w in a curve. Therefore fingertips that stick creep, tyres give sideways, and the
// platform sinks and tilts, each by a load f / m or an acceleration that does not depend on the step. Each
// bound below is that of the shipped plant (dt = 1 ms, d = 0.99, impratio = 100) and scales as its formula
// says. The paper's assumptions are judged with a tc of 2 dt, the least that the engine can step, and an
// impratio of 100: contacts that a scenario makes softer exceed the bounds. Distances grow with time and
// their rates do not: distances are judged over the last kSlipWindow, with kSlipWindow times the rate's
// bound.

/// f_t / m up to which a fingertip may creep, m/s^2: 10 N on a phalanx of 50 g. `hold` has 6, `two-hands`
/// 130.
constexpr double kTipLoad = 200.0;
/// f_n / m up to which it may sink in, m/s^2. `hold` has 28, `two-hands` 215.
constexpr double kTipPress = 500.0;
/// Acceleration v w in a curve up to which tyres may give, m/s^2. `curve` has 0.03.
constexpr double kSideways = 0.1;
/// Acceleration of load at a tyre, over the arm between the tyres, up to which the platform may tilt, 1/s^2.
constexpr double kTiltLoad = 250.0;
/// Acceleration of load that comes and goes within tc, m/s^2.
constexpr double kRollLoad = 0.5;
constexpr double kShippedTimeConstant = 2e-3;  // s
constexpr double kShippedSoftness = 1.0 - 0.99;
constexpr double kShippedCreep = kShippedSoftness * kShippedTimeConstant / 2.0 / 100.0 * kTipLoad;  // m/s
constexpr double kShippedLag = kShippedTimeConstant / 2.0 * kSideways;                              // m/s
constexpr double kShippedSinking = kShippedSoftness * kShippedTimeConstant * kShippedTimeConstant;  // s^2

constexpr double kUnitRounding = std::numeric_limits<double>::epsilon();

constexpr bool kOwn = true;       // FailureMeaning::is_own
constexpr bool kRelative = true;  // Bound::is_relative
using enum CheckCategory;
using enum CheckInfo::Moment;

using Analysis = StepAnalysis;

Evaluation When(bool applies, double value, double explained = 0.0) {
  if (!applies) return std::nullopt;
  return CheckValue{value, -1, explained};
}

/// Returns a value with the index of its part.
Evaluation At(const std::pair<double, int>& value) { return CheckValue{value.first, value.second}; }

template <double LawErrors::*error>
Evaluation OfLaw(const Analysis& a) {
  return !a.law ? std::nullopt : When(true, (*a.law).*error);
}

Evaluation EvaluateDemand(const Analysis& a) {
  if (!a.law) return std::nullopt;
  return CheckValue{a.law->demand, -1, a.law->demand_by_slip, a.law->demand_residual};
}

/// Optimality of the grasp force, judged where f_c is inside its cones and bounds.
Evaluation EvaluateOptimality(const Analysis& a) {
  return !a.law ? std::nullopt : When(!(a.law->grasp_cone > 0.0), a.law->grasp_optimality);
}

/// Deepest overlap, m.
template <typename Contact>
double CalcDepth(const std::vector<Contact>& contacts) {
  double depth = 0.0;
  for (const Contact& contact : contacts) depth = Worst(depth, contact.touching ? -contact.distance : 0.0);
  return depth;
}

/// Counts the fingertips that do not touch.
double CountMissing(const Analysis& a) {
  return static_cast<double>(std::ranges::count(a.step->response.contacts, false, &PlantContact::touching));
}

bool IsHolding(const Analysis& a) { return a.step->command.handling.holding; }
/// Whether the scenario's expectations begin.
bool IsExpected(const Analysis& a) { return a.step->time >= a.setup->scenario().expect.from; }
/// Returns the tracking error of an object that follows its motion; none before expectations begin.
Evaluation Tracked(const Analysis& a, double error, double by_hold) {
  return When(a.step->command.tracks && IsExpected(a), error, by_hold);
}

Evaluation EvaluateSolver(const Analysis& a) {
  if (!a.setup->has_object()) return When(true, a.robot.solver);
  return When(true, Worst(a.object.solver, a.robot.solver));
}

// name, category, unit;
// bound: shipped, reason, scaling, formula, whether relative;
// description;
// meaning of a failure: cause, rank, whether its own, sharper check;
// evaluation, its moments, and the description of a part
const CheckInfo kChecks[] = {
    // The radius is judged once, before anything moves. A radius of 1 never settles; at this bound it takes
    // 1e9 steps.
    {{"closed_loop_spectral_radius", kLaw, "1"},
     {1.0 - 1e-9, "an error that settles within 1e9 steps", Scaling::kNone, "1 - 1e-9"},
     "largest eigenvalue of the sampled (57) with the scenario's gains",
     {Cause::kControlLaw, Rank::kLaw, kOwn},
     {[](const Analysis& a) { return When(true, a.spectral_radius); }, kRunning}},
    {{"measurement", kLaw, "1"},
     {0.0, "copied, or computed twice from the same numbers"},
     "measured state against the true one, beyond what the scenario declares",
     {Cause::kSensing, Rank::kMeasurement, kOwn},
     {EvaluateMeasurement, kAlways | kUnsent}},
    {{"law_torque", kLaw, "1"},
     {kLawTorqueBound,
      "rounding of the terms, 1e-15, times condition number^2; the condition number is divided out",
      Scaling::kNone, nullptr, kRelative},
     "tau' sent against (53)-(55) from the engine's terms, relative to forces and condition number of J_B'",
     {Cause::kControlLaw, Rank::kLaw, kOwn},
     {OfLaw<&LawErrors::torque>, kAlways | kUnsent}},
    // C_bar' (xi - xi_c) and J_dot (xi - xi_c) remain where contacts slip, since (47) plans for xi_c and the
    // rigid system starts from xi. Slip speeds are some 1e-6 m/s and rates some 1/s. Measured: 8e-10.
    {{"law_demand", kLaw, "1"},
     {1e-8, "slip's C_bar' (xi - xi_c) and M_bar' J^+ J_dot (xi - xi_c) are subtracted", Scaling::kNone,
      "1e-8 + 10 slip forces", kRelative},
     "accelerations and forces of the rigid system (46), (48) against the demands of (47), (49), (55)",
     {Cause::kControlLaw, Rank::kLaw, kOwn},
     {EvaluateDemand, kRunning}},
    {{"grasp_null_space", kLaw, "1"},
     {kGraspNullBound, "the solver's residual of f_c, 1e-10, and the rounding of G^+"},
     "largest entry of G F_N, N and N m, over |f_c| and 1 N",
     {Cause::kControlLaw, Rank::kLaw, kOwn},
     {OfLaw<&LawErrors::grasp_null_space>, kRunning}},
    {{"grasp_cone", kLaw, "1"},
     {kGraspNullBound, "the solver's own f_c are inside"},
     "how far f_c = G^+ F_o + F_N is outside the friction cones, f_min and f_max, over |f_c| and 1 N",
     {Cause::kControlLaw, Rank::kLaw, kOwn},
     {OfLaw<&LawErrors::grasp_cone>, kRunning}},
    {{"grasp_optimality", kLaw, "1"},
     {kGraspOptimalityBound,
      "the solver's tolerance of slacks, 1e-5; near a cone's edge the slope follows with ten times that",
      Scaling::kNone, "10 slack_tolerance"},
     "slope of the grasp force's objective within null(G), over the whole slope and 1",
     {Cause::kControlLaw, Rank::kLaw, kOwn},
     {EvaluateOptimality, kRunning}},
    {{"torque_applied", kLaw, "1"},
     {1e-14, "a gear's ratio, once and back: two roundings"},
     "torques that the joints received against those that were sent, relative to the largest",
     {Cause::kActuator, Rank::kActuator, kOwn},
     {EvaluateMotors}},
    // The bound is the remaining error of law_demand over K_p = 400/s^2: 1e-8 of accelerations of some m/s^2,
    // times a condition number of some tens. Measured 1.2e-9 m in `curve`.
    {{"error_dynamics", kLaw, "m"},
     {1e-8, "K_p alone holds the error of law_demand", Scaling::kPositionGain, "4e-6 m/s^2 / K_p"},
     "object's position against the integrated (57), with unpredicted accelerations as input",
     {Cause::kUnexplained, Rank::kResidual},
     {OfLaw<&LawErrors::error_dynamics>, kRunning}},
    {{"orientation_dynamics", kLaw, "rad"},
     {1e-7, "as error_dynamics", Scaling::kOrientationGain, "4e-5 rad/s^2 / K_p"},
     "object's orientation, as error_dynamics",
     {Cause::kUnexplained, Rank::kResidual},
     {OfLaw<&LawErrors::orientation_dynamics>, kRunning}},
    {{"expect_position", kLaw, "m"},
     {0.0, "the scenario's bound; hold is (57) under a rigid plant's accelerations within a step",
      Scaling::kNone, "[expect] position + hold"},
     "object's position error, against what the scenario expects",
     {Cause::kControlLaw, Rank::kResidual},
     {[](const Analysis& a) { return Tracked(a, a.step->error.position.norm(), a.by_hold.first); },
      kRunning}},
    {{"expect_orientation", kLaw, "rad"},
     {0.0, "as expect_position", Scaling::kNone, "[expect] orientation + hold"},
     "object's orientation error, against what the scenario expects",
     {Cause::kControlLaw, Rank::kResidual},
     {[](const Analysis& a) { return Tracked(a, a.step->error.orientation, a.by_hold.second); }, kRunning}},
    // Measured 1e-14 for the Panda.
    {{"joint_dynamics", kLaw, "rad"},
     {1e-11, "rounding of torques, over the least inertia that they drive and over K_p"},
     "joints against the integrated e_ddot + K_v e_dot + K_p e = 0, with unpredicted accelerations as input",
     {Cause::kUnexplained, Rank::kResidual},
     {OfLaw<&LawErrors::error_dynamics>, kRunning}},
    {{"expect_joints", kLaw, "rad"},
     {0.0, "the scenario's bound", Scaling::kNone, "[expect] joints"},
     "largest error of a joint (rad or m), against what the scenario expects",
     {Cause::kControlLaw, Rank::kResidual},
     {[](const Analysis& a) {
        return When(a.step->command.joints.q.size() > 0 && IsExpected(a), a.step->error.joints);
      },
      kRunning}},
    // These two compare the whole robot at the true state, where joints that do not accelerate show as well.
    {{"mass_matrix", kModel, "1"},
     {1e-13, "rounding: 16 eps for each joint of a chain of 25", Scaling::kNone, nullptr, kRelative},
     "M of the whole robot against the engine's, relative to the summands",
     {Cause::kModel, Rank::kResidual},
     {[](const Analysis& a) { return At(a.whole.mass); }, kAlways, DescribeEntry}},
    {{"bias_force", kModel, "1"},
     {1e-13, "as mass_matrix", Scaling::kNone, nullptr, kRelative},
     "Coriolis forces, gravity and friction of the whole robot against the engine's",
     {Cause::kModel, Rank::kResidual},
     {[](const Analysis& a) { return At(a.whole.bias); }, kAlways, DescribeEntry}},
    // Measured 5e-16 over the shipped scenarios, falls and spinning wheels included.
    {{"equations_of_motion", kInverseDynamics, "1"},
     {1e-13, "as mass_matrix", Scaling::kNone, nullptr, kRelative},
     "residual of the equations of motion less the solver's remainder, relative to the summands",
     {Cause::kUnmodelledForce, Rank::kDecisive},
     {[](const Analysis& a) { return At(a.whole.residual); }, kAlways, DescribeEntry}},
    {{"inverse_dynamics_robot", kInverseDynamics, "1"},
     {1e-9, "rounding of cancelling forces, for the lightest links", Scaling::kNone, nullptr, kRelative},
     "the robot's part of that residual as in (48), relative to the forces that balance",
     {Cause::kUnmodelledForce, Rank::kDecisive},
     {[](const Analysis& a) { return When(true, a.robot.error); }}},
    // The object's dynamics have no other unknowns than its inertia and the contacts' geometry, which checks
    // of the model compare: where those hold, an unknown force acts on the object.
    {{"inverse_dynamics_object", kInverseDynamics, "1"},
     {1e-9, "rounding of the object's terms", Scaling::kNone, nullptr, kRelative},
     "the object's part of that residual as in (19), relative to the contact forces",
     {Cause::kUnmodelledForce, Rank::kObjectBalance},
     {[](const Analysis& a) { return When(true, a.object.error); }}},
    {{"constraint_force", kForwardDynamics, "1"},
     {kUnitRounding, "one rounding of sizes that count all operations on the row"},
     "largest difference of the engine's constraint forces and its documented law, relative to their sizes",
     {Cause::kContactSoftness, Rank::kResidual},
     {[](const Analysis& a) -> Evaluation {
        if (a.step->response.rows.empty()) return std::nullopt;
        return CheckValue{kUnitRounding * a.whole.constraint.first, a.whole.constraint.second};
      },
      kAlways, DescribeConstraint}},
    // The paper's contacts are rigid. The engine's delay a part of every changing force, in proportion to 1 -
    // d: measured 1e-6 and less in steady motion, 5e-2 in `curve-real`, 0.43 where fingertips touch.
    {{"reduced_acceleration", kAssumption, "1"},
     {1.0, "all forces: rigid contacts explain nothing any more", Scaling::kSofter,
      "1; 100 (1 - d) of softer contacts"},
     "xi_dot of the rigid constrained system (46), (48) against the engine's",
     {Cause::kContactSoftness, Rank::kPrediction},
     {[](const Analysis& a) { return When(true, a.rigid.acceleration); }}},
    {{"contact_force", kAssumption, "1"},
     {1.0, "as reduced_acceleration", Scaling::kSofter, "1; 100 (1 - d) of softer contacts"},
     "f_c of the rigid constrained system against the engine's, relative to |f_c|",
     {Cause::kContactSoftness, Rank::kPrediction},
     {[](const Analysis& a) { return When(true, a.rigid.contact_force); }}},
    // Slip and use of the cone distinguish sliding from contacts that only give.
    {{"fingertip_slip", kAssumption, "m"},
     {kSlipWindow * kShippedCreep, "the rate below, over the window", Scaling::kCreep,
      "10 s (1 - d) dt 2 m/s^2"},
     "how far a fingertip has slipped on the object in the last 5 to 10 s",
     {Cause::kContactSoftness, Rank::kAssumption, kOwn, "cone_use"},
     {[](const Analysis& a) { return When(IsHolding(a), a.slip.fingertips.distance); }}},
    {{"fingertip_slip_rate", kAssumption, "m/s"},
     {kShippedCreep,
      "creep under f_t / m of 200 m/s^2 at an impratio of 100; the known dt J_dot qvel is subtracted",
      Scaling::kCreep, "(1 - d) dt 2 m/s^2"},
     "speed of a fingertip's slip on the object, less the difference of (46) and the engine's constraint",
     {Cause::kContactSoftness, Rank::kAssumption, kOwn, "cone_use"},
     {[](const Analysis& a) { return When(IsHolding(a), a.slip.fingertips.rate); }}},
    {{"wheel_slip", kAssumption, "m"},
     {kSlipWindow * kShippedLag, "the rate below, over the window", Scaling::kLag, "10 s dt 0.1 m/s^2"},
     "how far a wheel has slipped on the floor in the last 5 to 10 s, (1)",
     {Cause::kContactSoftness, Rank::kAssumption, kOwn, "traction_use"},
     {[](const Analysis& a) { return When(true, a.slip.wheels.distance); }}},
    {{"wheel_slip_rate", kAssumption, "m/s"},
     {kShippedLag, "tyres creep sideways by v w / b, with v w up to 0.1 m/s^2", Scaling::kLag,
      "dt 0.1 m/s^2"},
     "how fast a wheel slips on the floor",
     {Cause::kContactSoftness, Rank::kAssumption, kOwn, "traction_use"},
     {[](const Analysis& a) { return When(true, a.slip.wheels.rate); }}},
    {{"rolling", kAssumption, "m/s"},
     {kShippedSoftness * kShippedTimeConstant * kRollLoad,
      "second order of the platform's tilt; slip is subtracted", Scaling::kSinkingRate,
      "(1 - d) tc 0.5 m/s^2 + slip"},
     "speed of a wheel's rim against that of the platform above it, less its slip, (1)",
     {Cause::kWheelGeometry, Rank::kDecisive, kOwn},
     {EvaluateRolling}},
    {{"foot_slip", kAssumption, "m"},
     {kSlipWindow * kShippedCreep, "as fingertip_slip", Scaling::kCreep, "10 s (1 - d) dt 2 m/s^2"},
     "how far a foot has slipped on the ground in the last 5 to 10 s",
     {Cause::kContactSoftness, Rank::kAssumption, kOwn, "foot_cone_use"},
     {[](const Analysis& a) { return When(true, a.slip.feet.distance); }, kRunning}},
    {{"foot_slip_rate", kAssumption, "m/s"},
     {kShippedCreep, "as fingertip_slip_rate", Scaling::kCreep, "(1 - d) dt 2 m/s^2"},
     "speed of a foot's slip on the ground, less the difference of (46) and the engine's constraint",
     {Cause::kContactSoftness, Rank::kAssumption, kOwn, "foot_cone_use"},
     {[](const Analysis& a) { return When(true, a.slip.feet.rate); }, kRunning}},
    {{"foot_cone_use", kAssumption, "1"},
     {0.99, "1 slides; how a foot's contacts share its load is not determined"},
     "friction's power at all contacts of a foot, over its maximum; 1 slides",
     {Cause::kFootSlip, Rank::kDecisive, kOwn},
     {[](const Analysis& a) { return When(true, a.slip.feet.cone_use); }}},
    {{"feet_lost", kAssumption, "m"},
     {kShippedSinking * kTipPress, "as foot_penetration; surplus feet may bear nothing", Scaling::kSinking,
      "4 (1 - d) dt^2 500 m/s^2"},
     "gap of a foot and the ground",
     {Cause::kFootSlip, Rank::kDecisive, kOwn},
     {[](const Analysis& a) { return When(true, a.contacts.foot_gap); }}},
    {{"foot_penetration", kAssumption, "m"},
     {kShippedSinking * kTipPress, "as penetration", Scaling::kSinking, "4 (1 - d) dt^2 500 m/s^2"},
     "overlap of a foot and the ground",
     {Cause::kContactSoftness, Rank::kAssumption, kOwn},
     {[](const Analysis& a) { return When(true, CalcDepth(a.step->response.feet)); }}},
    {{"foot_distance", kAssumption, "m"},
     {1e-12, "rounding of poses over lengths of some m"},
     "distance of a foot and the ground: the plant's against that of the declared shapes",
     {Cause::kContactGeometry, Rank::kObjectBalance, kOwn},
     {[](const Analysis& a) { return At(a.contacts.foot_mismatch); }, kAlways, DescribeFoot}},
    {{"cone_use", kAssumption, "1"},
     {0.99, "1 slides"},
     "tangential force over mu times normal force at a fingertip; 1 slides, (21)",
     {Cause::kFingertipSlip, Rank::kDecisive, kOwn},
     {[](const Analysis& a) { return When(IsHolding(a), a.slip.fingertips.cone_use); }}},
    {{"traction_use", kAssumption, "1"},
     {0.99, "1 slides"},
     "tangential force over mu times normal force at a wheel; 1 spins or skids",
     {Cause::kWheelSlip, Rank::kDecisive, kOwn},
     {[](const Analysis& a) { return When(true, a.slip.wheels.cone_use); }}},
    {{"contacts_lost", kAssumption, "1"},
     {0.0, "none"},
     "fingertips that do not touch the object",
     {Cause::kFingertipSlip, Rank::kDecisive, kOwn},
     {[](const Analysis& a) { return When(true, IsHolding(a) ? CountMissing(a) : 0.0); }}},
    {{"penetration", kAssumption, "m"},
     {kShippedSinking * kTipPress, "the overlap at rest under f_n / m of 500 m/s^2", Scaling::kSinking,
      "4 (1 - d) dt^2 500 m/s^2"},
     "overlap of fingertip and object",
     {Cause::kContactSoftness, Rank::kAssumption, kOwn},
     {[](const Analysis& a) { return When(true, CalcDepth(a.step->response.contacts)); }}},
    {{"contact_distance", kAssumption, "m"},
     {1e-12, "ten times the tolerance of FindContact, 1e-13 rad over lengths of 1 m"},
     "distance of a fingertip and the object: the plant's against that of the declared shapes",
     {Cause::kContactGeometry, Rank::kObjectBalance, kOwn},
     {EvaluateContactDistance, kAlways, DescribeFingertip}},
    // For the shipped step of 1 ms: the error of the trapezoidal rule, (rate dt)^2 / 12 of the way. Measured
    // 3e-9 at most in the shipped scenarios.
    {{"kappa", kAssumption, "m"},
     {0.1 * (10.0 * 1e-3) * (10.0 * 1e-3) / 12.0,
      "the trapezoidal rule, where contacts roll 0.1 m and turn at 10 rad/s", Scaling::kSquaredStep,
      "0.1 m (10 rad/s dt)^2 / 12"},
     "kappa integrated by (40) over the last 5 to 10 s against the engine's; psi at the fingertip's radius",
     {Cause::kContactSoftness},
     {.make = MakeKappaJudge}},
    // On the sphere that the plant has, contacts roll on; the paper's fingertip ends.
    {{"fingertip_rim", kAssumption, "m"},
     {0.0, "a hemisphere ends there"},
     "how far a contact is past the rim of its hemispherical fingertip",
     {Cause::kFingertipRim, Rank::kDecisive, kOwn},
     {EvaluateRim, kAlways, DescribeFingertip}},
    {{"base_tilt", kAssumption, "rad"},
     {kShippedSinking * kTiltLoad, "tyres sink under loads of 100 m/s^2 at an arm of 0.4 m",
      Scaling::kSinking, "4 (1 - d) dt^2 250 / s^2"},
     "angle of the platform against the vertical",
     {Cause::kTilt},
     {[](const Analysis& a) { return When(true, a.step->reading.departure.tilt); }}},
    {{"idle_joints", kAssumption, "rad"},
     {1e-5, "accelerations of soft contacts, over the posture task's stiffness", Scaling::kPosture,
      "(1 - d) dt^2 1e5 rad/s^4 / omega_p^2"},
     "movement since t = 0 of joints that do not carry the object",
     {},
     {.make = MakeIdleJointsJudge}},
    // The engine's solver stops where its cost, a square, falls by rounding only: measured 1.4e-5 of the
    // forces where contacts come and go in `lift`, 1e-12 elsewhere.
    {{"solver", kAssumption, "1"},
     {1e-4, "rounding of the solver's cost, under a root, where contacts come and go"},
     "remainder of the engine's solver in its equations of motion, measured as inverse_dynamics",
     {Cause::kSolver, Rank::kDecisive, kOwn},
     {EvaluateSolver}},
    // rad, m: rounding of a joint that rests exactly at the end of its range, as a closed gripper does.
    {{"joint_limit", kAssumption, "rad"},
     {1e-12, "a limit pushes; less is rounding"},
     "how far a joint is beyond its range, where a limit pushes that the model lacks",
     {Cause::kJointLimit, Rank::kDecisive, kOwn},
     {EvaluateJointLimit, kAlways, DescribeJoint}},
    // Ten times the accuracy of distances between bodies that are apart (solid.h).
    {{"clearance", kAssumption, "m"},
     {1e-6, "the bodies' distances are known to 1e-7 m"},
     "overlap of two bodies that must not touch",
     {Cause::kCollision, Rank::kAssumption, kOwn},
     {[](const Analysis& a) { return At(a.deepest_overlap); }, kAlways | kUnsent,
      [](const StepAnalyzer& a, int part) { return part < 0 ? "" : a.clearance().Describe(part); }}},
    {{"collision", kAssumption, "N"},
     {0.0, "the model has no such contact"},
     "largest force between two bodies that must not touch",
     {Cause::kCollision, Rank::kDecisive, kOwn},
     {[](const Analysis& a) { return At(std::pair(a.step->response.collision.force, 0)); }, kAlways | kUnsent,
      DescribeCollision}},
    {{"actuator_effort", kAssumption, "1"},
     {1.0, "the motor's limit"},
     "|tau'| over the motor's limit",
     {Cause::kActuatorLimit, Rank::kDecisive, kOwn},
     {[](const Analysis& a) { return When(true, a.step->drive.effort); }, kBefore}},
};

}  // namespace

std::span<const CheckInfo> ListChecks() { return kChecks; }

std::string DescribeWhatHolds(std::span<const CheckRecord> checks) {
  std::map<CheckCategory, bool> judged, same;
  bool judges_law = false;
  for (const CheckRecord& check : checks) {
    if (!check.applies || !IsReached(check)) continue;
    (check.same_source ? same : judged)[check.kind] = true;
    judges_law = judges_law || check.name == "law_torque";
  }
  std::string holds, missing;
  const auto add = [](const std::string& name, std::string* list) {
    *list += (list->empty() ? "" : ", ") + name;
  };
  const auto judge = [&](CheckCategory kind, const std::string& name) {
    if (judged[kind]) return add(name, &holds);
    add(name + (same[kind] ? " (model and plant are one file)" : ""), &missing);
  };
  judge(kModel, "model");
  if (judges_law || !judged[kLaw]) {
    judge(kLaw, "law");
  } else {
    add("motors and sensors", &holds);
    add("law", &missing);
  }
  const bool predicts = judged[kForwardDynamics] || same[kForwardDynamics];
  judge(kInverseDynamics, predicts ? "inverse and forward dynamics" : "inverse dynamics");
  judge(kAssumption, "assumptions");
  return holds + " hold at every step" + (missing.empty() ? "" : "; not judged: " + missing);
}

const CheckInfo* FindCheck(std::string_view name) {
  const auto* const found = std::ranges::find(kChecks, name, &CheckInfo::name);
  return found == std::end(kChecks) ? nullptr : found;
}

bool HoldsAlways(const CheckRecord& check) {
  const CheckInfo* info = FindCheck(check.name);
  const bool is_expectation = check.kind == kLaw && info != nullptr && info->meaning.rank == Rank::kResidual;
  return info != nullptr && check.kind != kAssumption && !is_expectation;
}

}  // namespace dexcheck
